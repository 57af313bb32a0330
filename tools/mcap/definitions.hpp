// The schemas and channels that a file has defined so far.
#pragma once

#include <map>

#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

class Definitions {
 public:
  /// False if it is known already. Another definition of the same id is a problem, and the first
  /// one stays.
  Expected<bool> add(const Schema& schema, std::uint64_t offset);
  /// The same; a channel with an unknown schema is also a problem.
  Expected<bool> add(const Channel& channel, std::uint64_t offset);

  /// Null if there is none.
  [[nodiscard]] const Schema* schema(SchemaId id) const;
  [[nodiscard]] const Channel* channel(ChannelId id) const;

  [[nodiscard]] const std::map<SchemaId, Schema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<ChannelId, Channel>& channels() const { return channels_; }

 private:
  std::map<SchemaId, Schema> schemas_;
  std::map<ChannelId, Channel> channels_;
};

}  // namespace millrace::tools::mcap
