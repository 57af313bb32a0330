#include "tools/mcap/scan.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "tools/mcap/codec.hpp"
#include "tools/mcap/compression.hpp"
#include "tools/mcap/summary.hpp"

namespace millrace::tools::mcap {

namespace {

/// Chunks are some MB at most; read at once, a larger one would be more than a host has memory.
constexpr std::uint64_t largest_chunk = std::uint64_t{1} << 30U;

/// Times, size, CRC and two lengths; the name of the compression comes on top.
constexpr std::uint64_t fixed_content = 8 + 8 + 8 + 4 + 4 + 8;
/// Longer than any name in MCAP's registry.
constexpr std::uint64_t longest_compression = 64;

/// Reads the frame from `bytes`, which begin at the record's prefix.
Expected<ChunkFrame> parse_frame(Bytes bytes, std::uint64_t offset, std::uint64_t file_size) {
  Cursor in(bytes, offset);
  ChunkFrame frame;
  frame.offset = offset;
  const bool is_chunk = in.u8() == static_cast<std::uint8_t>(Opcode::chunk);
  const std::uint64_t content = in.u64();
  frame.start = in.u64();
  frame.end = in.u64();
  frame.uncompressed_size = in.u64();
  frame.crc = in.u32();
  frame.compression = in.text();
  frame.records_size = in.u64();
  frame.records_offset = in.offset();
  const std::uint64_t available = file_size - offset;
  if (!in.ok() || content > available - record_prefix_size) {
    return problem(offset, "the file ends inside a Chunk record, or its length is damaged");
  }
  frame.length = record_prefix_size + content;
  if (!is_chunk || frame.records_size > content ||
      content != fixed_content + frame.compression.size() + frame.records_size) {
    return problem(offset, "the lengths of the Chunk record contradict each other");
  }
  if (frame.compression.empty() && frame.uncompressed_size != frame.records_size) {
    return problem(offset, "the sizes of the Chunk record contradict each other");
  }
  return frame;
}

}  // namespace

Expected<ChunkFrame> read_chunk_frame(Source& source, std::uint64_t offset) {
  std::string bytes;
  source.read(offset, record_prefix_size + fixed_content + longest_compression, bytes);
  return parse_frame(bytes, offset, source.size());
}

Expected<void> read_chunk_records(Source& source, const ChunkFrame& frame, std::string& records) {
  const auto compression = compression_of(frame.compression);
  if (!compression) {
    return problem(frame.offset, "the chunk is compressed with '" + frame.compression +
                                     "'; millrace reads lz4 and zstd: convert the file with "
                                     "'mcap filter --output-compression zstd'");
  }
  if (frame.records_size > largest_chunk) {
    return problem(frame.offset, "the chunk would exceed the size limit: its length is damaged");
  }
  source.read(frame.records_offset, frame.records_size, records);
  if (records.size() != frame.records_size) {
    return problem(frame.offset, "the chunk cannot be read to its end");
  }
  if (*compression != Compression::none) {
    const std::string packed = std::move(records);
    if (const auto done = decompress(*compression, packed, frame.uncompressed_size, records);
        !done) {
      return problem(frame.offset, "the chunk is damaged: its " + frame.compression +
                                       " data cannot be decompressed: " + done.error());
    }
  }
  if (frame.crc != 0 && frame.crc != crc32(records)) {
    return problem(frame.offset, "the chunk is damaged: its CRC is wrong");
  }
  return {};
}

std::optional<std::uint64_t> find_chunk(Source& source, std::uint64_t from, std::uint64_t to) {
  constexpr std::uint64_t window_size = std::uint64_t{64} * 1024;
  constexpr std::uint64_t frame_size = record_prefix_size + fixed_content;
  // A candidate for a chunk is read to check its CRC. A file can be full of candidates, each as
  // long as the rest; so their sum is limited.
  std::uint64_t patience = (std::uint64_t{64} << 20U) + 8 * (to - from);
  std::string window;
  std::string records;
  for (std::uint64_t start = from; start < to; start += window_size) {
    // Overlaps the next window by a frame, so that none is missed between two.
    source.read(start, window_size + frame_size, window);
    for (std::size_t at = 0; at + frame_size <= window.size() && start + at < to; ++at) {
      if (window[at] != static_cast<char>(Opcode::chunk)) {
        continue;
      }
      const auto frame = parse_frame(Bytes(window).substr(at), start + at, source.size());
      if (!frame || frame->crc == 0) {
        continue;
      }
      if (frame->records_size > patience) {
        return std::nullopt;
      }
      patience -= frame->records_size;
      records.clear();
      if (read_chunk_records(source, *frame, records)) {
        return frame->offset;
      }
      // The bytes that were decompressed in vain.
      patience -= std::min<std::uint64_t>(patience, records.size());
    }
  }
  return std::nullopt;
}

namespace {

constexpr std::uint64_t data_end_length = 4;
/// Of a record outside of chunks, which is read at once; a longer one has a damaged length.
constexpr std::uint64_t longest_record = std::uint64_t{256} << 20U;

/// The place of the record whose content begins with `in`.
std::uint64_t prefix_of(const Cursor& in) {
  return in.offset() - record_prefix_size;
}

class Scanner {
 public:
  Scanner(Source& source, Definitions known, Visitor& visitor)
      : source_(source), definitions_(std::move(known)), visitor_(visitor) {}

  /// See scan().
  bool run() {
    announce_known();
    read_start();
    while (!done_) {
      if (const auto prefix = read_prefix()) {
        read_record(*prefix);
      }
    }
    report_lost_messages();
    return closed_;
  }

 private:
  /// Opcode and content length.
  struct Prefix {
    std::uint8_t opcode = 0;
    std::uint64_t length = 0;
  };

  void announce_known() {
    for (const auto& [id, schema] : definitions_.schemas()) {
      visitor_.on_schema(schema);
    }
    for (const auto& [id, channel] : definitions_.channels()) {
      visitor_.on_channel(channel);
    }
  }

  void read_start() {
    if (source_.size() == 0) {
      report({0, "the file is empty"});
      done_ = true;
      return;
    }
    read_on(magic.size(), content_);
    if (content_ != magic) {
      resynchronise({0, "the file does not begin like an MCAP file"});
    }
  }

  std::optional<Prefix> read_prefix() {
    const std::uint64_t available = source_.size() - offset_;
    if (available < record_prefix_size) {
      report({offset_, available == 0 ? "the file ends here: it was never closed"
                                      : "the file ends inside the prefix of a record"});
      done_ = true;
      return std::nullopt;
    }
    source_.read(offset_, record_prefix_size, content_);
    Cursor in(content_);
    Prefix prefix;
    prefix.opcode = in.u8();
    prefix.length = in.u64();
    const bool is_chunk = prefix.opcode == static_cast<std::uint8_t>(Opcode::chunk);
    if (prefix.length > longest_record && !is_chunk) {
      resynchronise(
          {offset_, "the record (" + opcode_name(prefix.opcode) +
                        ") that begins here would exceed the size limit: its length is damaged"});
      return std::nullopt;
    }
    if (prefix.length > available - record_prefix_size) {
      resynchronise({offset_, "the file ends inside the record (" + opcode_name(prefix.opcode) +
                                  ") that begins here, or the record's length is damaged"});
      return std::nullopt;
    }
    return prefix;
  }

  // Each reads the record at offset_ and moves on to the next.
  void read_record(const Prefix& prefix) {
    const std::uint64_t begin = offset_;
    switch (static_cast<Opcode>(prefix.opcode)) {
      case Opcode::chunk:
        return read_chunk();
      case Opcode::data_end:
        return read_data_end(prefix);
      case Opcode::footer:
      case Opcode::chunk_index:
      case Opcode::attachment_index:
      case Opcode::statistics:
      case Opcode::metadata_index:
      case Opcode::summary_offset:
        return resynchronise({begin, "a record of the summary (" + opcode_name(prefix.opcode) +
                                         ") is among the data"});
      default:
        break;
    }
    if (prefix.opcode == 0) {
      return resynchronise({begin, "a record has the type 0, which does not exist"});
    }
    read_on(record_prefix_size + prefix.length, content_);
    Cursor in(Bytes(content_).substr(record_prefix_size), begin + record_prefix_size);
    take_top_level(prefix.opcode, in);
    if (!in.empty() || !in.ok()) {
      look_inside(begin);
    }
  }

  void read_chunk() {
    const auto frame = read_chunk_frame(source_, offset_);
    if (!frame) {
      return resynchronise(frame.error());
    }
    index_expected_ = true;
    certain_ = frame->offset + frame->length;
    if (!visitor_.wants(*frame)) {
      data_crc_.reset();
      offset_ = certain_;
      return;
    }
    if (const auto read = mcap::read_chunk_records(source_, *frame, records_); !read) {
      report(read.error());
      offset_ = certain_;
      return;
    }
    read_on(frame->records_offset - frame->offset, content_);
    if (!frame->compression.empty() && data_crc_) {
      // Of the bytes as they are in the file.
      read_on(frame->records_size, content_);
    } else {
      offset_ += frame->records_size;
      data_crc_ = data_crc_ ? std::optional(crc32(records_, *data_crc_)) : std::nullopt;
    }
    visitor_.on_chunk(*frame);
    take_chunk_records(*frame);
  }

  void read_data_end(const Prefix& prefix) {
    if (prefix.length != data_end_length) {
      return resynchronise({offset_, "the DataEnd record has a wrong length"});
    }
    source_.read(offset_ + record_prefix_size, data_end_length, content_);
    Cursor in(content_, offset_ + record_prefix_size);
    const auto end = decode<DataEnd>(in);
    if (end && end->crc != 0 && data_crc_ && *data_crc_ != end->crc) {
      report(
          {offset_,
           "the CRC of all data is wrong although each chunk is correct: something outside of the "
           "chunks, or the CRC itself, is damaged"});
    }
    done_ = true;
    closed_ = !has_appendix(offset_ + record_prefix_size + data_end_length);
  }

  /// Whether something follows the summary that begins at `start`: 'cat a b' makes such a file. It
  /// is reported; a damaged summary is left to its reader.
  bool has_appendix(std::uint64_t start) {
    for (std::uint64_t at = start; at - start <= largest_summary;) {
      source_.read(at, record_prefix_size, content_);
      Cursor in(content_);
      const std::uint8_t opcode = in.u8();
      const std::uint64_t length = in.u64();
      if (!in.ok() || length > source_.size() - at - record_prefix_size) {
        return false;
      }
      at += record_prefix_size + length;
      if (opcode != static_cast<std::uint8_t>(Opcode::footer)) {
        continue;
      }
      source_.read(at, magic.size(), content_);
      at += magic.size();
      if (content_ != magic || at >= source_.size()) {
        return false;
      }
      report({at, "the recording ends here, but the file continues: the " +
                      std::to_string(source_.size() - at) +
                      " bytes from here on are not read; 'tail -c +" + std::to_string(at + 1) +
                      "' makes a file of them"});
      return true;
    }
    return false;
  }

  void report(const Problem& problem) {
    // The problem is reported; the CRC of all data would only repeat it.
    data_crc_.reset();
    visitor_.on_problem(problem);
  }

  /// After a record from `begin` to offset_ whose fields do not fill it exactly: goes back to a
  /// chunk inside of it.
  void look_inside(std::uint64_t begin) {
    if (const auto chunk = find_chunk(source_, begin, offset_)) {
      report({begin, "the length of the record that begins here is damaged: it covers a chunk"});
      offset_ = *chunk;
    }
  }

  /// Reports, and continues at the next readable chunk.
  void resynchronise(const Problem& problem) {
    report(problem);
    index_expected_ = false;
    // The length of the previous record may be wrong, so that it covers a chunk.
    const auto next = find_chunk(source_, certain_, source_.size());
    done_ = !next;
    offset_ = next.value_or(offset_);
  }

  /// Reads [offset_, offset_ + size) into `out` and counts it for the data section's CRC.
  void read_on(std::uint64_t size, std::string& out) {
    source_.read(offset_, size, out);
    offset_ += size;
    if (data_crc_) {
      data_crc_ = crc32(out, *data_crc_);
    }
  }

  // Each takes the content of a record that is in memory.
  void take_chunk_records(const ChunkFrame& frame) {
    // Compressed records have no position of their own in the file: the chunk's is used for all of
    // them.
    const bool here = frame.compression.empty();
    const auto place = [&](std::uint64_t offset) { return here ? offset : frame.offset; };
    Cursor in(records_, frame.records_offset);
    while (!in.empty()) {
      const std::uint64_t begin = place(in.offset());
      const std::uint8_t opcode = in.u8();
      const Bytes content = in.take(in.u64());
      if (!in.ok()) {
        report({begin, "the chunk's records end inside a record"});
        break;
      }
      if (opcode == 0) {
        // Zeros are not records of length 0.
        report({begin,
                "a record of the chunk has the type 0, which does not exist; the rest of the "
                "chunk is skipped"});
        break;
      }
      Cursor fields(content, begin + record_prefix_size);
      take(opcode, fields);
    }
    report_lost_messages();
  }

  void take_top_level(std::uint8_t opcode, Cursor& in) {
    if (static_cast<Opcode>(opcode) == Opcode::message_index) {
      return take_index(in);
    }
    if (static_cast<Opcode>(opcode) == Opcode::message && index_expected_) {
      // Its bytes have no CRC of their own; one flipped bit makes a Message of a MessageIndex.
      return report(
          {prefix_of(in), "a Message record is between a chunk and its indexes; skipped"});
    }
    index_expected_ = false;
    switch (static_cast<Opcode>(opcode)) {
      case Opcode::header:
        return hand_out<Header>(in, &Visitor::on_header);
      case Opcode::attachment:
        return hand_out<Attachment>(in, &Visitor::on_attachment);
      case Opcode::metadata: {
        const std::uint64_t offset = prefix_of(in);
        const auto metadata = decode<Metadata>(in);
        return metadata ? visitor_.on_metadata(*metadata, offset) : report(metadata.error());
      }
      default:
        return take(opcode, in);
    }
  }

  void take(std::uint8_t opcode, Cursor& in) {
    switch (static_cast<Opcode>(opcode)) {
      case Opcode::schema:
        return define<Schema>(in);
      case Opcode::channel:
        return define<Channel>(in);
      case Opcode::message:
        return take_message(in);
      default:
        break;
    }
    if (opcode < first_private_opcode) {
      report({prefix_of(in),
              "a record of type " + opcode_name(opcode) + " does not belong here; skipped"});
    }
  }

  void take_message(Cursor& in) {
    const std::uint64_t offset = prefix_of(in);
    const auto message = decode<Message>(in);
    if (!message) {
      return report(message.error());
    }
    if (const Channel* channel = definitions_.channel(message->channel)) {
      return visitor_.on_message(*channel, *message, offset);
    }
    Lost& lost = lost_[message->channel];
    if (lost.messages++ == 0) {
      lost.first_offset = offset;
    }
  }

  void take_index(Cursor& in) {
    const std::uint64_t offset = prefix_of(in);
    // Its contents are ignored: a reader from front to back needs no index.
    const auto index = decode<MessageIndex>(in);
    if (!index) {
      report(index.error());
    } else if (!index_expected_) {
      report({offset, "a MessageIndex record follows no chunk: a chunk before it is lost"});
    }
  }

  template <typename Definition>
  void define(Cursor& in) {
    const std::uint64_t offset = prefix_of(in);
    const auto definition = decode<Definition>(in);
    if (!definition) {
      return report(definition.error());
    }
    const auto added = definitions_.add(*definition, offset);
    if (!added) {
      report(added.error());
    } else if (*added) {
      if constexpr (std::is_same_v<Definition, Schema>) {
        visitor_.on_schema(*definition);
      } else {
        visitor_.on_channel(*definition);
      }
    }
  }

  template <typename Record>
  void hand_out(Cursor& in, void (Visitor::*to)(const Record&)) {
    const auto record = decode<Record>(in);
    if (!record) {
      return report(record.error());
    }
    (visitor_.*to)(*record);
  }

  void report_lost_messages() {
    for (const auto& [channel, lost] : lost_) {
      report({lost.first_offset, std::to_string(lost.messages) +
                                     " messages from here on belong to "
                                     "channel " +
                                     std::to_string(channel) +
                                     ", whose definition is missing; they cannot be read"});
    }
    lost_.clear();
  }

  Source& source_;
  Definitions definitions_;
  Visitor& visitor_;
  std::uint64_t offset_ = 0;
  /// End of the last chunk. The lengths of later records may be wrong.
  std::uint64_t certain_ = 0;
  bool done_ = false;
  bool closed_ = false;
  /// The last record was a chunk or one of its indexes: indexes belong directly after a chunk.
  bool index_expected_ = false;
  /// Of everything before offset_; none once something was skipped or found damaged.
  std::optional<std::uint32_t> data_crc_ = 0;
  std::string content_;
  std::string records_;

  struct Lost {
    std::uint64_t messages = 0;
    std::uint64_t first_offset = 0;
  };
  /// Messages of channels without a definition, in the chunk that is being read.
  std::map<ChannelId, Lost> lost_;
};

}  // namespace

bool scan(Source& source, Definitions known, Visitor& visitor) {
  return Scanner(source, std::move(known), visitor).run();
}

}  // namespace millrace::tools::mcap
