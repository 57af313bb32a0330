#include "tools/mcap/codec.hpp"

#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

namespace {

/// Appends one record; its length is filled in at the end.
class Record {
 public:
  Record(std::string& out, Opcode opcode) : out_(out) {
    u8(static_cast<std::uint8_t>(opcode));
    u64(0);
    content_ = out_.size();
  }
  ~Record() {
    const std::uint64_t length = out_.size() - content_;
    for (std::size_t i = 0; i < sizeof length; ++i) {
      out_[content_ - sizeof length + i] = static_cast<char>(length >> (8 * i));
    }
  }
  Record(const Record&) = delete;
  Record& operator=(const Record&) = delete;

  Record& u8(std::uint8_t value) { return integer(value, 1); }
  Record& u16(std::uint16_t value) { return integer(value, 2); }
  Record& u32(std::uint32_t value) { return integer(value, 4); }
  Record& u64(std::uint64_t value) { return integer(value, 8); }
  Record& bytes(Bytes bytes) {
    out_.append(bytes);
    return *this;
  }
  Record& text(std::string_view text) {
    return u32(static_cast<std::uint32_t>(text.size())).bytes(text);
  }
  Record& map(const StringMap& map) {
    std::size_t size = 0;
    for (const auto& [key, value] : map) {
      size += 2 * sizeof(std::uint32_t) + key.size() + value.size();
    }
    u32(static_cast<std::uint32_t>(size));
    for (const auto& [key, value] : map) {
      text(key).text(value);
    }
    return *this;
  }
  /// A map from channel to a number.
  Record& map(const std::map<ChannelId, std::uint64_t>& map) {
    u32(static_cast<std::uint32_t>(map.size() * (sizeof(ChannelId) + sizeof(std::uint64_t))));
    for (const auto& [key, value] : map) {
      u16(key).u64(value);
    }
    return *this;
  }
  /// The bytes after the prefix.
  [[nodiscard]] Bytes content() const { return Bytes(out_).substr(content_); }

 private:
  Record& integer(std::uint64_t value, std::size_t size) {
    for (std::size_t i = 0; i < size; ++i) {
      out_.push_back(static_cast<char>(value >> (8 * i)));
    }
    return *this;
  }

  std::string& out_;
  std::size_t content_ = 0;
};

}  // namespace

void append(std::string& out, const Header& header) {
  Record(out, Opcode::header).text(header.profile).text(header.library);
}

void append_footer(std::string& out, const Footer& footer, std::uint32_t crc_before) {
  const std::size_t begin = out.size();
  Record record(out, Opcode::footer);
  record.u64(footer.summary_start).u64(footer.summary_offset_start);
  // The length is part of what the CRC covers, and is not filled in yet: it is always 20.
  std::string covered(Bytes(out).substr(begin));
  covered[1] = 20;
  record.u32(crc32(covered, crc_before));
}

void append(std::string& out, const Schema& schema) {
  Record(out, Opcode::schema)
      .u16(schema.id)
      .text(schema.name)
      .text(schema.encoding)
      .text(schema.data);
}

void append(std::string& out, const Channel& channel) {
  Record(out, Opcode::channel)
      .u16(channel.id)
      .u16(channel.schema)
      .text(channel.topic)
      .text(channel.message_encoding)
      .map(channel.metadata);
}

void append(std::string& out, const Message& message) {
  Record(out, Opcode::message)
      .u16(message.channel)
      .u32(message.sequence)
      .u64(message.log_time)
      .u64(message.publish_time)
      .bytes(message.data);
}

void append(std::string& out, const Chunk& chunk) {
  Record(out, Opcode::chunk)
      .u64(chunk.start)
      .u64(chunk.end)
      .u64(chunk.uncompressed_size)
      .u32(chunk.crc)
      .text(chunk.compression)
      .u64(chunk.records.size())
      .bytes(chunk.records);
}

void append(std::string& out, const MessageIndex& index) {
  Record record(out, Opcode::message_index);
  record.u16(index.channel).u32(static_cast<std::uint32_t>(index.entries.size() * 16));
  for (const auto& [time, offset] : index.entries) {
    record.u64(time).u64(offset);
  }
}

void append(std::string& out, const ChunkIndex& index) {
  Record(out, Opcode::chunk_index)
      .u64(index.start)
      .u64(index.end)
      .u64(index.chunk_offset)
      .u64(index.chunk_length)
      .map(index.message_index_offsets)
      .u64(index.message_index_length)
      .text(index.compression)
      .u64(index.compressed_size)
      .u64(index.uncompressed_size);
}

void append(std::string& out, const Attachment& attachment) {
  Record record(out, Opcode::attachment);
  record.u64(attachment.log_time)
      .u64(attachment.create_time)
      .text(attachment.name)
      .text(attachment.media_type)
      .u64(attachment.data.size())
      .bytes(attachment.data);
  record.u32(crc32(record.content()));
}

void append(std::string& out, const AttachmentIndex& index) {
  Record(out, Opcode::attachment_index)
      .u64(index.offset)
      .u64(index.length)
      .u64(index.log_time)
      .u64(index.create_time)
      .u64(index.data_size)
      .text(index.name)
      .text(index.media_type);
}

void append(std::string& out, const Statistics& statistics) {
  Record(out, Opcode::statistics)
      .u64(statistics.messages)
      .u16(statistics.schemas)
      .u32(statistics.channels)
      .u32(statistics.attachments)
      .u32(statistics.metadata)
      .u32(statistics.chunks)
      .u64(statistics.start)
      .u64(statistics.end)
      .map(statistics.channel_messages);
}

void append(std::string& out, const Metadata& metadata) {
  Record(out, Opcode::metadata).text(metadata.name).map(metadata.values);
}

void append(std::string& out, const MetadataIndex& index) {
  Record(out, Opcode::metadata_index).u64(index.offset).u64(index.length).text(index.name);
}

void append(std::string& out, const SummaryOffset& offset) {
  Record(out, Opcode::summary_offset)
      .u8(static_cast<std::uint8_t>(offset.group))
      .u64(offset.start)
      .u64(offset.length);
}

void append(std::string& out, const DataEnd& end) {
  Record(out, Opcode::data_end).u32(end.crc);
}

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
