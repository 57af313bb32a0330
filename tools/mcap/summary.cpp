#include "tools/mcap/summary.hpp"

#include <algorithm>

#include "tools/mcap/codec.hpp"
#include "tools/mcap/cursor.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

namespace {

constexpr std::uint64_t footer_content = 8 + 8 + 4;
constexpr std::uint64_t tail_size = record_prefix_size + footer_content + magic.size();
constexpr std::uint64_t data_end_size = record_prefix_size + 4;

Expected<Footer> read_footer(Source& source) {
  if (source.size() < magic.size() + tail_size) {
    return problem(source.size(), "the file is too short for a footer: it was never closed");
  }
  const std::uint64_t offset = source.size() - tail_size;
  std::string tail;
  source.read(offset, tail_size, tail);
  Cursor in(tail, offset);
  const bool is_footer = in.u8() == static_cast<std::uint8_t>(Opcode::footer);
  if (!is_footer || in.u64() != footer_content || !Bytes(tail).ends_with(magic)) {
    return problem(offset, "the file does not end with a footer: it was never closed, or was cut");
  }
  return decode<Footer>(in);
}

/// The bytes between the data section and the footer, after their CRC has been checked.
Expected<std::string> read_summary_bytes(Source& source, const Footer& footer) {
  const std::uint64_t footer_offset = source.size() - tail_size;
  const std::uint64_t start = footer.summary_start;
  if (start == 0) {
    return problem(footer_offset, "the file has no summary");
  }
  if (start < magic.size() + data_end_size || start > footer_offset) {
    return problem(footer_offset, "the footer has an impossible position of the summary");
  }
  std::string bytes;
  source.read(start - data_end_size, 1, bytes);
  if (bytes.empty() || bytes[0] != static_cast<char>(Opcode::data_end)) {
    return problem(start, "there is no DataEnd record before the summary: the footer is damaged");
  }
  const std::uint64_t covered = source.size() - start - magic.size() - sizeof footer.summary_crc;
  source.read(start, covered, bytes);
  if (footer.summary_crc != 0 && crc32(bytes) != footer.summary_crc) {
    return problem(start, "the summary is damaged: its CRC is wrong");
  }
  bytes.resize(std::min(bytes.size(), static_cast<std::size_t>(footer_offset - start)));
  return bytes;
}

/// Takes the records of a summary one by one.
class SummaryReader {
 public:
  Expected<void> take(std::uint8_t opcode, Cursor in) {
    switch (static_cast<Opcode>(opcode)) {
      case Opcode::schema:
        return define<Schema>(in);
      case Opcode::channel:
        return define<Channel>(in);
      case Opcode::statistics:
        has_statistics_ = true;
        return keep<Statistics>(in, [&](Statistics& record) { summary_.statistics = record; });
      case Opcode::chunk_index:
        return keep<ChunkIndex>(in, [&](ChunkIndex& record) { summary_.chunks.push_back(record); });
      case Opcode::attachment_index:
        return keep<AttachmentIndex>(
            in, [&](AttachmentIndex& record) { summary_.attachments.push_back(record); });
      case Opcode::metadata_index:
        return keep<MetadataIndex>(
            in, [&](MetadataIndex& record) { summary_.metadata.push_back(record); });
      default:
        return {};
    }
  }
  [[nodiscard]] bool has_statistics() const { return has_statistics_; }
  Summary result() { return std::move(summary_); }

 private:
  template <typename Record, typename Keep>
  Expected<void> keep(Cursor& in, const Keep& keep) {
    auto record = decode<Record>(in);
    if (!record) {
      return tl::unexpected(record.error());
    }
    keep(*record);
    return {};
  }
  template <typename Record>
  Expected<void> define(Cursor& in) {
    const std::uint64_t offset = in.offset();
    return decode<Record>(in)
        .and_then([&](const Record& record) { return summary_.definitions.add(record, offset); })
        .map([](bool) {});
  }

  Summary summary_;
  bool has_statistics_ = false;
};

}  // namespace

Expected<Header> read_header(Source& source) {
  std::string bytes;
  source.read(0, magic.size() + record_prefix_size, bytes);
  Cursor in(bytes);
  if (in.take(magic.size()) != magic) {
    return problem(0, "the file does not begin like an MCAP file");
  }
  const bool is_header = in.u8() == static_cast<std::uint8_t>(Opcode::header);
  const std::uint64_t length = in.u64();
  if (!is_header || length > source.size()) {
    return problem(magic.size(), "the file has no header");
  }
  const std::uint64_t offset = in.offset();
  source.read(offset, length, bytes);
  Cursor content(bytes, offset);
  return decode<Header>(content);
}

Expected<Summary> read_summary(Source& source) {
  const auto footer = read_footer(source);
  if (!footer) {
    return tl::unexpected(footer.error());
  }
  auto header = read_header(source);
  if (!header) {
    return tl::unexpected(header.error());
  }
  const auto bytes = read_summary_bytes(source, *footer);
  if (!bytes) {
    return tl::unexpected(bytes.error());
  }
  SummaryReader reader;
  Cursor in(*bytes, footer->summary_start);
  while (!in.empty()) {
    const std::uint8_t opcode = in.u8();
    const Bytes content = in.take(in.u64());
    if (!in.ok()) {
      return in.problem("last summary");
    }
    if (auto taken = reader.take(opcode, Cursor(content, in.offset() - content.size())); !taken) {
      return tl::unexpected(taken.error());
    }
  }
  if (!reader.has_statistics()) {
    return problem(footer->summary_start, "the summary has no statistics");
  }
  Summary summary = reader.result();
  summary.header = std::move(*header);
  return summary;
}

Expected<Metadata> read_metadata(Source& source, const MetadataIndex& index) {
  std::string bytes;
  source.read(index.offset, std::min(index.length, source.size()), bytes);
  Cursor in(bytes, index.offset);
  const bool is_metadata = in.u8() == static_cast<std::uint8_t>(Opcode::metadata);
  const Bytes content = in.take(in.u64());
  if (!in.ok() || !is_metadata) {
    return problem(index.offset, "the summary names a missing Metadata record");
  }
  Cursor fields(content, in.offset() - content.size());
  return decode<Metadata>(fields);
}

}  // namespace millrace::tools::mcap
