#include "tools/mcap/chunk_builder.hpp"

#include <algorithm>

#include "tools/mcap/crc32.hpp"
#include "tools/mcap/encode.hpp"

namespace millrace::tools::mcap {

void ChunkBuilder::add(const Schema& schema) {
  append(records_, schema);
}

void ChunkBuilder::add(const Channel& channel) {
  append(records_, channel);
}

void ChunkBuilder::add(const Message& message) {
  start_ = indexes_.empty() ? message.log_time : std::min(start_, message.log_time);
  end_ = std::max(end_, message.log_time);
  MessageIndex& index = indexes_[message.channel];
  index.channel = message.channel;
  index.entries.emplace_back(message.log_time, records_.size());
  append(records_, message);
}

ChunkIndex ChunkBuilder::finish(std::string& out, std::uint64_t base, Compression compression) {
  if (records_.size() > largest_uncompressed) {
    compression = Compression::none;
  }
  ChunkIndex place;
  place.start = start_;
  place.end = end_;
  place.uncompressed_size = records_.size();
  place.compression = name_of(compression);
  place.chunk_offset = base + out.size();
  const std::string packed =
      compression == Compression::none ? std::string() : compress(compression, records_);
  const Bytes stored = compression == Compression::none ? Bytes(records_) : Bytes(packed);
  place.compressed_size = stored.size();
  append(out, Chunk{start_, end_, records_.size(), crc32(records_), place.compression, stored});
  const std::uint64_t indexes_start = base + out.size();
  place.chunk_length = indexes_start - place.chunk_offset;
  for (auto& [channel, index] : indexes_) {
    // Readers search it by time; messages of several sources may arrive out of order.
    std::stable_sort(index.entries.begin(), index.entries.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    place.message_index_offsets[channel] = base + out.size();
    append(out, index);
  }
  place.message_index_length = base + out.size() - indexes_start;
  records_.clear();
  indexes_.clear();
  start_ = end_ = 0;
  return place;
}

}  // namespace millrace::tools::mcap
