#include "tools/mcap/summary.hpp"

#include <algorithm>

#include "tools/mcap/codec.hpp"
#include "tools/mcap/scan.hpp"

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
    return std::string();
  }
  if (start < magic.size() + data_end_size || start > footer_offset) {
    return problem(footer_offset, "the footer has an impossible position of the summary");
  }
  std::string bytes;
  source.read(start - data_end_size, 1, bytes);
  if (bytes.empty() || bytes[0] != static_cast<char>(Opcode::data_end)) {
    return problem(start, "there is no DataEnd record before the summary: the footer is damaged");
  }
  if (footer_offset - start > largest_summary) {
    return problem(start, "the summary would exceed the size limit, 64 MiB");
  }
  const std::uint64_t covered = source.size() - start - magic.size() - sizeof footer.summary_crc;
  source.read(start, covered, bytes);
  if (footer.summary_crc != 0 && crc32(bytes) != footer.summary_crc) {
    return problem(start, "the summary is damaged: its CRC is wrong");
  }
  bytes.resize(std::min(bytes.size(), static_cast<std::size_t>(footer_offset - start)));
  return bytes;
}

/// Takes one record of a summary.
Expected<void> take(std::uint8_t opcode, Cursor in, Summary& summary) {
  const auto keep = [&in](auto& all) {
    return decode<typename std::remove_cvref_t<decltype(all)>::value_type>(in).map(
        [&](auto&& record) { all.push_back(std::move(record)); });
  };
  const auto define = [&, offset = in.offset()](auto definition) {
    return std::move(definition)
        .and_then([&](const auto& record) { return summary.definitions.add(record, offset); })
        .map([](bool) {});
  };
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::schema:
      return define(decode<Schema>(in));
    case Opcode::channel:
      return define(decode<Channel>(in));
    case Opcode::statistics:
      summary.has_statistics = true;
      return decode<Statistics>(in).map(
          [&](Statistics&& record) { summary.statistics = std::move(record); });
    case Opcode::chunk_index:
      return keep(summary.chunks);
    case Opcode::attachment_index:
      return keep(summary.attachments);
    case Opcode::metadata_index:
      return keep(summary.metadata);
    default:
      return {};
  }
}

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
  Summary summary;
  summary.header = std::move(*header);
  Cursor in(*bytes, footer->summary_start);
  while (!in.empty()) {
    const std::uint8_t opcode = in.u8();
    const Bytes content = in.take(in.u64());
    if (!in.ok()) {
      return in.problem("last summary");
    }
    const auto taken = take(opcode, Cursor(content, in.offset() - content.size()), summary);
    if (!taken) {
      return tl::unexpected(taken.error());
    }
  }
  return summary;
}

namespace {

/// Of the metadata records of a file together, in bytes. The recorder writes some kB.
constexpr std::uint64_t most_metadata = std::uint64_t{4} << 20U;

Problem too_much_metadata(std::uint64_t offset, const std::string& name) {
  return {offset, "the metadata record '" + name +
                      "' exceeds the size limit of all such records, 4 MiB; it is not shown"};
}

Expected<Metadata> read_metadata(Source& source, const MetadataIndex& index) {
  std::string bytes;
  source.read(index.offset, index.length, bytes);
  Cursor in(bytes, index.offset);
  const bool is_metadata = in.u8() == static_cast<std::uint8_t>(Opcode::metadata);
  const Bytes content = in.take(in.u64());
  if (!in.ok() || !is_metadata) {
    return problem(index.offset, "the summary names a missing Metadata record");
  }
  Cursor fields(content, in.offset() - content.size());
  return decode<Metadata>(fields);
}

}  // namespace

std::vector<Metadata> read_metadata(Source& source, const Summary& summary, Problems& problems) {
  std::vector<Metadata> all;
  std::uint64_t size = 0;
  for (const MetadataIndex& index : summary.metadata) {
    if (index.length > most_metadata - size) {
      problems.add(too_much_metadata(index.offset, index.name));
      continue;
    }
    size += index.length;
    if (auto metadata = read_metadata(source, index)) {
      all.push_back(std::move(*metadata));
    } else {
      problems.add(std::move(metadata.error()));
    }
  }
  return all;
}

namespace {

std::uint64_t size_of(const Metadata& metadata) {
  std::uint64_t size = metadata.name.size();
  for (const auto& [key, value] : metadata.values) {
    size += sizeof(StringMap::value_type) + key.size() + value.size();
  }
  return size;
}

void count(Survey& survey, const std::string& compression, std::uint64_t stored,
           std::uint64_t uncompressed) {
  ChunkSizes& sizes = survey.chunk_sizes[compression];
  ++sizes.chunks;
  sizes.stored += stored;
  sizes.uncompressed += uncompressed;
}

/// Counts what a scan finds.
class Counter : public Visitor {
 public:
  void on_header(const Header& header) override { survey_.summary.header = header; }
  void on_schema(const Schema& schema) override {
    (void)survey_.summary.definitions.add(schema, 0);
    ++statistics().schemas;
  }
  void on_channel(const Channel& channel) override {
    (void)survey_.summary.definitions.add(channel, 0);
    ++statistics().channels;
  }
  void on_chunk(const ChunkFrame& chunk) override {
    ++statistics().chunks;
    count(survey_, chunk.compression, chunk.records_size, chunk.uncompressed_size);
  }
  void on_message(const Channel& channel, const Message& message, std::uint64_t) override {
    Statistics& all = statistics();
    all.start = all.messages == 0 ? message.log_time : std::min(all.start, message.log_time);
    all.end = std::max(all.end, message.log_time);
    ++all.messages;
    ++all.channel_messages[channel.id];
  }
  void on_attachment(const Attachment&) override { ++statistics().attachments; }
  void on_metadata(const Metadata& metadata, std::uint64_t offset) override {
    ++statistics().metadata;
    if (size_of(metadata) > most_metadata - metadata_size_) {
      return survey_.problems.add(too_much_metadata(offset, metadata.name));
    }
    metadata_size_ += size_of(metadata);
    survey_.metadata.push_back(metadata);
  }
  void on_problem(const Problem& problem) override { survey_.problems.add(problem); }

  Survey& survey() { return survey_; }

 private:
  Statistics& statistics() { return survey_.summary.statistics; }

  Survey survey_;
  std::uint64_t metadata_size_ = 0;
};

Survey survey_by_scan(Source& source, const Expected<Summary>& summary) {
  Counter counter;
  const bool closed = scan(source, {}, counter);
  Survey& survey = counter.survey();
  survey.closed = closed && summary;
  if (closed && !summary) {
    // The data have an end, so a damaged summary is a new problem; otherwise the scan has reported
    // it.
    survey.problems.add(summary.error());
  }
  return std::move(survey);
}

}  // namespace

Survey survey(Source& source) {
  auto summary = read_summary(source);
  if (!summary || !summary->has_statistics) {
    return survey_by_scan(source, summary);
  }
  Survey result;
  result.from_summary = true;
  result.closed = true;
  result.summary = std::move(*summary);
  for (const ChunkIndex& chunk : result.summary.chunks) {
    count(result, chunk.compression, chunk.compressed_size, chunk.uncompressed_size);
  }
  result.metadata = read_metadata(source, result.summary, result.problems);
  return result;
}

}  // namespace millrace::tools::mcap
