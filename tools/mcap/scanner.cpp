#include "tools/mcap/scanner.hpp"

#include "tools/mcap/codec.hpp"
#include "tools/mcap/cursor.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

namespace {

constexpr std::uint64_t data_end_length = 4;
/// Of a record outside of chunks, which is read at once; a longer one has a damaged length.
constexpr std::uint64_t longest_record = std::uint64_t{256} << 20U;

}  // namespace

bool scan(Source& source, Definitions known, Visitor& visitor) {
  return Scanner(source, std::move(known), visitor).run();
}

bool Scanner::run() {
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

void Scanner::announce_known() {
  for (const auto& [id, schema] : definitions_.schemas()) {
    visitor_.on_schema(schema);
  }
  for (const auto& [id, channel] : definitions_.channels()) {
    visitor_.on_channel(channel);
  }
}

void Scanner::read_start() {
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

std::optional<Scanner::Prefix> Scanner::read_prefix() {
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

void Scanner::read_record(const Prefix& prefix) {
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

void Scanner::read_chunk() {
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

void Scanner::read_data_end(const Prefix& prefix) {
  if (prefix.length != data_end_length) {
    return resynchronise({offset_, "the DataEnd record has a wrong length"});
  }
  source_.read(offset_ + record_prefix_size, data_end_length, content_);
  Cursor in(content_, offset_ + record_prefix_size);
  const auto end = decode<DataEnd>(in);
  if (end && end->crc != 0 && data_crc_ && *data_crc_ != end->crc) {
    report({offset_,
            "the CRC of all data is wrong although each chunk is correct: something outside of the "
            "chunks, or the CRC itself, is damaged"});
  }
  closed_ = true;
  done_ = true;
}

void Scanner::report(const Problem& problem) {
  // The problem is reported; the CRC of all data would only repeat it.
  data_crc_.reset();
  visitor_.on_problem(problem);
}

void Scanner::look_inside(std::uint64_t begin) {
  if (const auto chunk = find_chunk(source_, begin, offset_)) {
    report({begin, "the length of the record that begins here is damaged: it covers a chunk"});
    offset_ = *chunk;
  }
}

void Scanner::resynchronise(const Problem& problem) {
  report(problem);
  index_expected_ = false;
  // The length of the previous record may be wrong, so that it covers a chunk.
  const auto next = find_chunk(source_, certain_, source_.size());
  done_ = !next;
  offset_ = next.value_or(offset_);
}

void Scanner::read_on(std::uint64_t size, std::string& out) {
  source_.read(offset_, size, out);
  offset_ += size;
  if (data_crc_) {
    data_crc_ = crc32(out, *data_crc_);
  }
}

}  // namespace millrace::tools::mcap
