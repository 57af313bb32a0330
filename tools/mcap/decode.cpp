#include "tools/mcap/decode.hpp"

#include "tools/mcap/crc32.hpp"

namespace millrace::tools::mcap {

namespace {

template <typename T>
Expected<T> whole(const Cursor& in, T value, const char* record) {
  if (!in.ok()) {
    return in.problem(record);
  }
  return value;
}

StringMap string_map(Cursor& in) {
  StringMap map;
  Cursor pairs = in.nested();
  while (pairs.ok() && !pairs.empty()) {
    std::string key = pairs.text();
    map[std::move(key)] = pairs.text();
  }
  in.check(pairs);
  return map;
}

std::map<ChannelId, std::uint64_t> channel_map(Cursor& in) {
  std::map<ChannelId, std::uint64_t> map;
  Cursor pairs = in.nested();
  while (pairs.ok() && !pairs.empty()) {
    const ChannelId channel = pairs.u16();
    map[channel] = pairs.u64();
  }
  in.check(pairs);
  return map;
}

}  // namespace

template <>
Expected<Header> decode(Cursor& in) {
  Header header;
  header.profile = in.text();
  header.library = in.text();
  return whole(in, std::move(header), "Header");
}

template <>
Expected<Footer> decode(Cursor& in) {
  Footer footer;
  footer.summary_start = in.u64();
  footer.summary_offset_start = in.u64();
  footer.summary_crc = in.u32();
  return whole(in, footer, "Footer");
}

template <>
Expected<Schema> decode(Cursor& in) {
  const std::uint64_t offset = in.offset();
  Schema schema;
  schema.id = in.u16();
  schema.name = in.text();
  schema.encoding = in.text();
  schema.data = in.text();
  if (in.ok() && schema.id == 0) {
    return problem(offset, "a Schema record has the id 0, which means 'none'");
  }
  return whole(in, std::move(schema), "Schema");
}

template <>
Expected<Channel> decode(Cursor& in) {
  Channel channel;
  channel.id = in.u16();
  channel.schema = in.u16();
  channel.topic = in.text();
  channel.message_encoding = in.text();
  channel.metadata = string_map(in);
  return whole(in, std::move(channel), "Channel");
}

template <>
Expected<Message> decode(Cursor& in) {
  Message message;
  message.channel = in.u16();
  message.sequence = in.u32();
  message.log_time = in.u64();
  message.publish_time = in.u64();
  message.data = in.take(in.rest().size());
  return whole(in, message, "Message");
}

template <>
Expected<Chunk> decode(Cursor& in) {
  Chunk chunk;
  chunk.start = in.u64();
  chunk.end = in.u64();
  chunk.uncompressed_size = in.u64();
  chunk.crc = in.u32();
  chunk.compression = in.text();
  chunk.records = in.take(in.u64());
  return whole(in, std::move(chunk), "Chunk");
}

template <>
Expected<MessageIndex> decode(Cursor& in) {
  MessageIndex index;
  index.channel = in.u16();
  Cursor entries = in.nested();
  while (entries.ok() && !entries.empty()) {
    const Nanoseconds time = entries.u64();
    index.entries.emplace_back(time, entries.u64());
  }
  in.check(entries);
  return whole(in, std::move(index), "MessageIndex");
}

template <>
Expected<ChunkIndex> decode(Cursor& in) {
  ChunkIndex index;
  index.start = in.u64();
  index.end = in.u64();
  index.chunk_offset = in.u64();
  index.chunk_length = in.u64();
  index.message_index_offsets = channel_map(in);
  index.message_index_length = in.u64();
  index.compression = in.text();
  index.compressed_size = in.u64();
  index.uncompressed_size = in.u64();
  return whole(in, std::move(index), "ChunkIndex");
}

template <>
Expected<Attachment> decode(Cursor& in) {
  const std::uint64_t offset = in.offset();
  const Bytes content = in.rest();
  Attachment attachment;
  attachment.log_time = in.u64();
  attachment.create_time = in.u64();
  attachment.name = in.text();
  attachment.media_type = in.text();
  attachment.data = in.take(in.u64());
  const Bytes covered = content.substr(0, content.size() - in.rest().size());
  const std::uint32_t crc = in.u32();
  if (in.ok() && crc != 0 && crc != crc32(covered)) {
    return problem(offset, "the attachment '" + attachment.name + "' is damaged: its CRC is wrong");
  }
  return whole(in, std::move(attachment), "Attachment");
}

template <>
Expected<AttachmentIndex> decode(Cursor& in) {
  AttachmentIndex index;
  index.offset = in.u64();
  index.length = in.u64();
  index.log_time = in.u64();
  index.create_time = in.u64();
  index.data_size = in.u64();
  index.name = in.text();
  index.media_type = in.text();
  return whole(in, std::move(index), "AttachmentIndex");
}

template <>
Expected<Statistics> decode(Cursor& in) {
  Statistics statistics;
  statistics.messages = in.u64();
  statistics.schemas = in.u16();
  statistics.channels = in.u32();
  statistics.attachments = in.u32();
  statistics.metadata = in.u32();
  statistics.chunks = in.u32();
  statistics.start = in.u64();
  statistics.end = in.u64();
  statistics.channel_messages = channel_map(in);
  return whole(in, std::move(statistics), "Statistics");
}

template <>
Expected<Metadata> decode(Cursor& in) {
  Metadata metadata;
  metadata.name = in.text();
  metadata.values = string_map(in);
  return whole(in, std::move(metadata), "Metadata");
}

template <>
Expected<MetadataIndex> decode(Cursor& in) {
  MetadataIndex index;
  index.offset = in.u64();
  index.length = in.u64();
  index.name = in.text();
  return whole(in, std::move(index), "MetadataIndex");
}

template <>
Expected<DataEnd> decode(Cursor& in) {
  const DataEnd end{in.u32()};
  return whole(in, end, "DataEnd");
}

}  // namespace millrace::tools::mcap
