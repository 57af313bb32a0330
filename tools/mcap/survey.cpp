#include <algorithm>

#include "tools/mcap/scan.hpp"
#include "tools/mcap/summary.hpp"

namespace millrace::tools::mcap {

namespace {

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
  void on_metadata(const Metadata& metadata) override {
    survey_.metadata.push_back(metadata);
    ++statistics().metadata;
  }
  void on_problem(const Problem& problem) override { survey_.problems.push_back(problem); }

  Survey& survey() { return survey_; }

 private:
  Statistics& statistics() { return survey_.summary.statistics; }

  Survey survey_;
};

Survey survey_by_scan(Source& source, Problem why) {
  Counter counter;
  if (scan(source, {}, counter)) {
    // The data have an end, so a missing summary is a new problem; otherwise the scan has reported
    // it.
    counter.survey().problems.push_back(std::move(why));
  }
  return std::move(counter.survey());
}

}  // namespace

Survey survey(Source& source) {
  auto summary = read_summary(source);
  if (!summary) {
    return survey_by_scan(source, std::move(summary.error()));
  }
  Survey result;
  result.from_summary = true;
  result.summary = std::move(*summary);
  for (const ChunkIndex& chunk : result.summary.chunks) {
    count(result, chunk.compression, chunk.compressed_size, chunk.uncompressed_size);
  }
  for (const MetadataIndex& index : result.summary.metadata) {
    auto metadata = read_metadata(source, index);
    if (metadata) {
      result.metadata.push_back(std::move(*metadata));
    } else {
      result.problems.push_back(std::move(metadata.error()));
    }
  }
  return result;
}

}  // namespace millrace::tools::mcap
