#include "tools/mcap/encode.hpp"

#include "tools/mcap/crc32.hpp"

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

}  // namespace millrace::tools::mcap
