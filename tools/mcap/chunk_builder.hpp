// The chunk that is being filled: its records and the index of its messages.
#pragma once

#include <map>
#include <string>

#include "tools/mcap/compression.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

class ChunkBuilder {
 public:
  void add(const Schema& schema);
  void add(const Channel& channel);
  void add(const Message& message);

  [[nodiscard]] bool empty() const { return records_.empty(); }
  /// Bytes of its records.
  [[nodiscard]] std::size_t size() const { return records_.size(); }

  /// Appends the chunk and its message indexes to `out`, whose first byte is at `base` of the file,
  /// and starts an empty one. The result has their positions. A chunk that is too large for readers
  /// to decompress is not compressed.
  ChunkIndex finish(std::string& out, std::uint64_t base, Compression compression);

 private:
  std::string records_;
  std::map<ChannelId, MessageIndex> indexes_;
  Nanoseconds start_ = 0;
  Nanoseconds end_ = 0;
};

}  // namespace millrace::tools::mcap
