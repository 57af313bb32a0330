// The records of an MCAP file, version 0 (https://mcap.dev/spec), as C++ values.
//
// Times are nanoseconds since 1970-01-01T00:00:00Z. Bulk data are views into the buffer they were
// decoded from; everything else is owned.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::tools::mcap {

/// Raw bytes with another owner.
using Bytes = std::string_view;
using Nanoseconds = std::uint64_t;
using ChannelId = std::uint16_t;
using SchemaId = std::uint16_t;
using StringMap = std::map<std::string, std::string>;

/// First and last eight bytes of a file; the '0' is the version.
inline constexpr Bytes magic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0a,
  statistics = 0x0b,
  metadata = 0x0c,
  metadata_index = 0x0d,
  summary_offset = 0x0e,
  data_end = 0x0f,
};

/// Opcodes from here on are private to applications; lower ones that have no name are reserved.
inline constexpr std::uint8_t first_private_opcode = 0x80;

/// Opcode and length before each record's content.
inline constexpr std::size_t record_prefix_size = 9;

struct Header {
  static constexpr Opcode opcode = Opcode::header;
  std::string profile;
  /// Program and version that wrote the file.
  std::string library;
  bool operator==(const Header&) const = default;
};

/// The type of a channel's messages. Id 0 is invalid.
struct Schema {
  static constexpr Opcode opcode = Opcode::schema;
  SchemaId id = 0;
  std::string name;
  std::string encoding;
  std::string data;
  bool operator==(const Schema&) const = default;
};

/// A stream of messages. Schema 0 = none.
struct Channel {
  static constexpr Opcode opcode = Opcode::channel;
  ChannelId id = 0;
  SchemaId schema = 0;
  std::string topic;
  std::string message_encoding;
  StringMap metadata;
  bool operator==(const Channel&) const = default;
};

struct Message {
  static constexpr Opcode opcode = Opcode::message;
  ChannelId channel = 0;
  std::uint32_t sequence = 0;
  /// When it was recorded.
  Nanoseconds log_time = 0;
  /// When it was published.
  Nanoseconds publish_time = 0;
  Bytes data;
};

/// A batch of schemas, channels and messages.
struct Chunk {
  static constexpr Opcode opcode = Opcode::chunk;
  Nanoseconds start = 0;
  Nanoseconds end = 0;
  std::uint64_t uncompressed_size = 0;
  /// Of the uncompressed records, 0 = not given.
  std::uint32_t crc = 0;
  /// Empty = none.
  std::string compression;
  Bytes records;
};

/// Where one channel's messages are in the chunk before: log time and offset into its records.
struct MessageIndex {
  static constexpr Opcode opcode = Opcode::message_index;
  ChannelId channel = 0;
  std::vector<std::pair<Nanoseconds, std::uint64_t>> entries;
};

struct ChunkIndex {
  static constexpr Opcode opcode = Opcode::chunk_index;
  Nanoseconds start = 0;
  Nanoseconds end = 0;
  std::uint64_t chunk_offset = 0;
  /// Prefix included.
  std::uint64_t chunk_length = 0;
  /// Offset in the file of each channel's MessageIndex.
  std::map<ChannelId, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
};

/// A file inside the file.
struct Attachment {
  static constexpr Opcode opcode = Opcode::attachment;
  Nanoseconds log_time = 0;
  Nanoseconds create_time = 0;
  std::string name;
  std::string media_type;
  Bytes data;
};

struct AttachmentIndex {
  static constexpr Opcode opcode = Opcode::attachment_index;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  Nanoseconds log_time = 0;
  Nanoseconds create_time = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
};

struct Statistics {
  static constexpr Opcode opcode = Opcode::statistics;
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0;
  std::uint32_t attachments = 0;
  std::uint32_t metadata = 0;
  std::uint32_t chunks = 0;
  Nanoseconds start = 0;
  Nanoseconds end = 0;
  std::map<ChannelId, std::uint64_t> channel_messages{};
  bool operator==(const Statistics&) const = default;
};

struct Metadata {
  static constexpr Opcode opcode = Opcode::metadata;
  std::string name;
  StringMap values;
  bool operator==(const Metadata&) const = default;
};

struct MetadataIndex {
  static constexpr Opcode opcode = Opcode::metadata_index;
  std::uint64_t offset = 0;
  std::uint64_t length = 0;
  std::string name;
};

/// Where the summary's records of one opcode are.
struct SummaryOffset {
  static constexpr Opcode opcode = Opcode::summary_offset;
  Opcode group = Opcode::header;
  std::uint64_t start = 0;
  std::uint64_t length = 0;
};

struct DataEnd {
  static constexpr Opcode opcode = Opcode::data_end;
  /// Of every byte before this record, 0 = not given.
  std::uint32_t crc = 0;
};

/// Offsets 0 = the section is missing.
struct Footer {
  static constexpr Opcode opcode = Opcode::footer;
  std::uint64_t summary_start = 0;
  std::uint64_t summary_offset_start = 0;
  /// From summary_start through the footer's summary_offset_start, 0 = not given.
  std::uint32_t summary_crc = 0;
};

// The checksum of MCAP: CRC-32 with zlib's polynomial.

/// The checksum of what `before` is the checksum of, followed by `bytes`.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

// Names of record types for messages.

/// "Chunk", or "0x42" for an opcode without a name.
std::string opcode_name(std::uint8_t opcode);

// A problem of a file, and its position.

struct Problem {
  /// Byte of the file at which it begins.
  std::uint64_t offset = 0;
  std::string text;

  /// "at byte 4711: …"
  [[nodiscard]] std::string to_string() const {
    return "at byte " + std::to_string(offset) + ": " + text;
  }
  bool operator==(const Problem&) const = default;
};

/// The problems of a file, in its order. A file of a few kB can have millions: equal ones in a row
/// are one, and only the first are kept.
class Problems {
 public:
  static constexpr std::size_t most = 100;
  /// Bytes of a text; it may contain a name from the file.
  static constexpr std::size_t longest_text = 1000;

  void add(Problem problem);

  [[nodiscard]] std::size_t size() const { return list_.size(); }
  [[nodiscard]] bool empty() const { return list_.empty(); }
  /// With the number of those in a row, and at the end the number of those that are not kept:
  /// "… (and 17 more of these, the last at byte 4800)".
  [[nodiscard]] std::vector<Problem> described() const;
  [[nodiscard]] const Problem& operator[](std::size_t index) const { return list_[index].first; }
  bool operator==(const Problems&) const = default;

 private:
  /// Equal problems in a row.
  struct Run {
    Problem first;
    std::uint64_t more = 0;
    std::uint64_t last_offset = 0;
    bool operator==(const Run&) const = default;
  };

  std::vector<Run> list_;
  /// Those after the last one that is kept.
  Run omitted_;
};

template <typename T>
using Expected = tl::expected<T, Problem>;

inline tl::unexpected<Problem> problem(std::uint64_t offset, std::string text) {
  return tl::unexpected(Problem{offset, std::move(text)});
}

// The schemas and channels that a file has defined so far.

class Definitions {
 public:
  /// Bytes of all together: they stay in memory, and a compressed chunk holds a thousand times its
  /// size.
  static constexpr std::uint64_t most_bytes = std::uint64_t{64} << 20U;

  /// False if it is known already. Another definition of the same id is a problem, and the first
  /// one stays; so is one that exceeds the limit.
  Expected<bool> add(const Schema& schema, std::uint64_t offset);
  /// The same; a channel with an unknown schema is also a problem.
  Expected<bool> add(const Channel& channel, std::uint64_t offset);

  /// Null if there is none.
  [[nodiscard]] const Schema* schema(SchemaId id) const;
  [[nodiscard]] const Channel* channel(ChannelId id) const;

  [[nodiscard]] const std::map<SchemaId, Schema>& schemas() const { return schemas_; }
  [[nodiscard]] const std::map<ChannelId, Channel>& channels() const { return channels_; }

 private:
  template <typename Definition>
  Expected<bool> add_to(std::map<std::uint16_t, Definition>& all, const Definition& definition,
                        const std::string& name, std::uint64_t offset);

  std::map<SchemaId, Schema> schemas_;
  std::map<ChannelId, Channel> channels_;
  std::uint64_t bytes_ = 0;
};

}  // namespace millrace::tools::mcap
