#include "tests/unit/tools/mcap/sample_file.hpp"

#include <ostream>

#include "tools/mcap/scan.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/mcap/writer.hpp"

namespace millrace::tools::mcap::tests {

namespace {

class Collector : public Visitor {
 public:
  void on_message(const Channel&, const Message& message, std::uint64_t) override {
    scanned.messages.push_back(
        {message.channel, message.sequence, message.log_time, std::string(message.data)});
  }
  void on_metadata(const Metadata&, std::uint64_t) override { ++scanned.metadata; }
  void on_attachment(const Attachment&) override { ++scanned.attachments; }
  void on_problem(const Problem& problem) override { scanned.problems.add(problem); }

  Scanned scanned;
};

}  // namespace

std::ostream& operator<<(std::ostream& out, const Read& message) {
  return out << message.channel << "#" << message.sequence << " " << message.data;
}

std::vector<Read> SampleFile::messages_within(std::uint64_t size) const {
  std::vector<Read> messages;
  for (std::size_t i = 0; i < chunks.size(); ++i) {
    if (chunk_ends[i] <= size) {
      messages.insert(messages.end(), chunks[i].begin(), chunks[i].end());
    }
  }
  return messages;
}

SampleFile sample_file(std::size_t chunks, std::size_t messages, Compression compression) {
  SampleFile sample;
  Memory file;
  Writer writer(file, {.library = "sample", .compression = compression});
  (void)writer.write(Metadata{"origin", {{"host", "here"}}});
  writer.define(Schema{1, "Number", "jsonschema", "{}"});
  writer.define(Channel{1, 1, "odd", "json", {{"unit", "mm"}}});
  writer.define(Channel{2, 1, "even", "json", {}});
  std::uint32_t number = 0;
  for (std::size_t c = 0; c < chunks; ++c) {
    auto& chunk = sample.chunks.emplace_back();
    for (std::size_t m = 0; m < messages; ++m) {
      ++number;
      const Read read{static_cast<ChannelId>(number % 2 == 1 ? 1 : 2), number, 1000 + number * 10U,
                      "{\"number\":" + std::to_string(number) + "}"};
      chunk.push_back(read);
      (void)writer.write(
          Message{read.channel, read.sequence, read.log_time, read.log_time - 1, read.data});
    }
    (void)writer.close_chunk();
    if (c == 0) {
      (void)writer.write(Attachment{5, 6, "note.txt", "text/plain", "a note"});
    }
  }
  (void)writer.close();
  sample.bytes = file.bytes();
  const auto summary = read_summary(file);
  for (const ChunkIndex& index : summary->chunks) {
    sample.chunk_ends.push_back(index.chunk_offset + index.chunk_length);
  }
  return sample;
}

Scanned scan_all(Source& source) {
  Collector collector;
  const auto summary = read_summary(source);
  collector.scanned.closed =
      scan(source, summary ? summary->definitions : Definitions{}, collector);
  return std::move(collector.scanned);
}

Scanned scan_all(const std::string& bytes) {
  Memory memory(bytes);
  return scan_all(memory);
}

}  // namespace millrace::tools::mcap::tests
