#include "tools/mcap/writer.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include "tools/mcap/codec.hpp"

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
  std::string packed;
  if (records_.size() <= largest_uncompressed && compression != Compression::none) {
    packed = compress(compression, records_);
  }
  if (records_.size() > largest_content(packed.size())) {
    compression = Compression::none;
  }
  ChunkIndex place;
  place.start = start_;
  place.end = end_;
  place.uncompressed_size = records_.size();
  place.compression = name_of(compression);
  place.chunk_offset = base + out.size();
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

namespace {

template <typename Key, typename Value>
const Value& record_of(const std::pair<const Key, Value>& entry) {
  return entry.second;
}

template <typename Record>
const Record& record_of(const Record& record) {
  return record;
}

}  // namespace

Writer::Writer(Sink& sink, WriterOptions options) : sink_(sink), options_(std::move(options)) {
  pending_ = magic;
  append(pending_, Header{options_.profile, options_.library});
}

void Writer::define(const Schema& schema) {
  assert(schema.id != 0);
  const auto [place, added] = schemas_.emplace(schema.id, schema);
  assert(place->second == schema);
  if (added) {
    chunk_.add(schema);
    statistics_.schemas = static_cast<std::uint16_t>(schemas_.size());
  }
}

void Writer::define(const Channel& channel) {
  assert(channel.schema == 0 || schemas_.contains(channel.schema));
  const auto [place, added] = channels_.emplace(channel.id, channel);
  assert(place->second == channel);
  if (added) {
    chunk_.add(channel);
    statistics_.channels = static_cast<std::uint32_t>(channels_.size());
  }
}

Writer::Result Writer::write(const Message& message) {
  assert(knows(message.channel));
  chunk_.add(message);
  statistics_.start =
      statistics_.messages == 0 ? message.log_time : std::min(statistics_.start, message.log_time);
  statistics_.end = std::max(statistics_.end, message.log_time);
  ++statistics_.messages;
  ++statistics_.channel_messages[message.channel];
  if (chunk_.size() >= options_.chunk_size) {
    return close_chunk();
  }
  return {};
}

Writer::Result Writer::write(const Attachment& attachment) {
  const std::uint64_t offset = written_ + pending_.size();
  append(pending_, attachment);
  attachments_.push_back({offset, written_ + pending_.size() - offset, attachment.log_time,
                          attachment.create_time, attachment.data.size(), attachment.name,
                          attachment.media_type});
  ++statistics_.attachments;
  return flush();
}

Writer::Result Writer::write(const Metadata& metadata) {
  const std::uint64_t offset = written_ + pending_.size();
  append(pending_, metadata);
  metadata_.push_back({offset, written_ + pending_.size() - offset, metadata.name});
  ++statistics_.metadata;
  return flush();
}

Writer::Result Writer::close_chunk() {
  end_chunk();
  return flush();
}

void Writer::end_chunk() {
  if (!chunk_.empty()) {
    chunks_.push_back(chunk_.finish(pending_, written_, options_.compression));
    ++statistics_.chunks;
    messages_chunked_ = statistics_.messages;
  }
}

Writer::Result Writer::close() {
  if (!std::exchange(closed_, true)) {
    end_chunk();
    count();
    append(pending_, DataEnd{data_crc_});
    append_summary();
    pending_ += magic;
  }
  return flush();
}

void Writer::count() {
  data_crc_ = crc32(Bytes(pending_).substr(counted_), data_crc_);
  counted_ = pending_.size();
}

Writer::Result Writer::flush() {
  count();
  auto result = sink_.write(pending_);
  if (result) {
    written_ += pending_.size();
    pending_.clear();
    counted_ = 0;
    messages_taken_ = messages_chunked_;
  }
  return result;
}

void Writer::append_summary() {
  const std::size_t begin = pending_.size();
  append_group(Opcode::schema, schemas_);
  append_group(Opcode::channel, channels_);
  append_group(Opcode::statistics, std::array{statistics_});
  append_group(Opcode::chunk_index, chunks_);
  append_group(Opcode::attachment_index, attachments_);
  append_group(Opcode::metadata_index, metadata_);
  const Footer footer{written_ + begin, written_ + pending_.size(), 0};
  for (const SummaryOffset& group : groups_) {
    append(pending_, group);
  }
  append_footer(pending_, footer, crc32(Bytes(pending_).substr(begin)));
}

template <typename Records>
void Writer::append_group(Opcode opcode, const Records& records) {
  if (records.empty()) {
    return;
  }
  const std::uint64_t start = written_ + pending_.size();
  for (const auto& entry : records) {
    append(pending_, record_of(entry));
  }
  groups_.push_back({opcode, start, written_ + pending_.size() - start});
}

}  // namespace millrace::tools::mcap
