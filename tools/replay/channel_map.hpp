// Maps recorded channels to live ones. Pure.
//
//   ChannelMap map;
//   map.add("cnc/1=test/7");
//   map.find({"cnc", 1})        // test/7
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::tools::replay {

class ChannelMap {
 public:
  /// "cnc/1=test/7" for a channel, "cnc=test" for all channels of a machine that have no entry of
  /// their own. The error names what was expected.
  tl::expected<void, std::string> add(std::string_view text);
  /// The channel for a recorded one; nothing if there is no entry.
  [[nodiscard]] std::optional<fabric::ChannelKey> find(const fabric::ChannelKey& recorded) const;
  [[nodiscard]] bool empty() const { return channels_.empty() && machines_.empty(); }

 private:
  std::map<fabric::ChannelKey, fabric::ChannelKey> channels_;
  std::map<std::string, std::string> machines_;
};

}  // namespace millrace::tools::replay
