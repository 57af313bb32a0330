// Entries are written to a file and read back.
#include "tools/recording/writer.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recording {
namespace {

using tests::at;
using tests::one_call;

/// Ten calls, one chunk each.
std::string ten_calls() {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  RecordingWriter sut(writer);
  for (std::uint64_t number = 1; number <= 10; ++number) {
    for (const Entry& entry : one_call(number, static_cast<double>(number) * 100)) {
      EXPECT_TRUE(sut.write(entry));
    }
    EXPECT_TRUE(writer.close_chunk());
  }
  EXPECT_TRUE(writer.close());
  return file.bytes();
}

std::vector<Entry> read(mcap::Source& file, const Filter& filter) {
  std::vector<Entry> entries;
  const ReadReport report =
      read_entries(file, filter, [&](const Entry& entry) { entries.push_back(entry); });
  EXPECT_EQ(report.problems, mcap::Problems{});
  EXPECT_EQ(report.foreign, 0U);
  return entries;
}

TEST(RecordingWriter, WritesWhatTheReaderReads) {
  mcap::Memory file(ten_calls());
  const std::vector<Entry> entries = read(file, {});
  ASSERT_EQ(entries.size(), 70U);
  EXPECT_EQ(kind_of(entries[1]), "request");
  EXPECT_EQ(entries[1].at, at(101.1));
  EXPECT_EQ(call_of(entries[69]), (fabric::CallId{0x5f, 10}));
}

TEST(RecordingWriter, NamesChannelsByWhatHappened) {
  mcap::Memory file(ten_calls());
  const auto summary = mcap::read_summary(file);
  ASSERT_TRUE(summary);
  std::map<std::string, std::uint64_t> counts;
  for (const auto& [id, channel] : summary->definitions.channels()) {
    counts[channel.topic] = summary->statistics.channel_messages.at(id);
    EXPECT_EQ(channel.message_encoding, "protobuf");
    EXPECT_TRUE(channel.metadata.at("dds_topic").starts_with("millrace/"));
  }
  EXPECT_EQ(counts, (std::map<std::string, std::uint64_t>{{"machine/cnc/1/event", 40},
                                                          {"machine/cnc/1/reply", 10},
                                                          {"machine/cnc/1/request", 10},
                                                          {"machine/cnc/1/withdrawal", 10}}));
}

TEST(RecordingReader, ReadsOnlyTheChunksOfTheSelectedTime) {
  class Counting : public mcap::Memory {
   public:
    using Memory::Memory;
    void read(std::uint64_t offset, std::uint64_t length, std::string& out) override {
      Memory::read(offset, length, out);
      largest = std::max(largest, out.size());
      total += out.size();
    }
    std::size_t largest = 0;
    std::size_t total = 0;
  };
  Counting all(ten_calls());
  EXPECT_EQ(read(all, {}).size(), 70U);
  Counting some(ten_calls());
  EXPECT_EQ(read(some, {.from = at(500), .to = at(599)}).size(), 7U);
  EXPECT_LT(some.total, all.total);
}

TEST(RecordingReader, CountsForeignMessages) {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  writer.define(mcap::Channel{1, 0, "other/topic", "json", {}});
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "{}"}));
  ASSERT_TRUE(writer.close());
  const ReadReport report = read_entries(file, {}, [](const Entry&) { FAIL(); });
  EXPECT_EQ(report.foreign, 1U);
}

TEST(RecordingReader, NamesAMessageThatIsDamaged) {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  writer.define(mcap::Schema{1, "millrace.recording.Request", "protobuf", "x"});
  writer.define(mcap::Channel{1, 1, "machine/cnc/1/request", "protobuf", {}});
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "\xff"}));
  ASSERT_TRUE(writer.close());
  const ReadReport report = read_entries(file, {}, [](const Entry&) { FAIL(); });
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0].text, "the message is not a millrace.recording.Request");
  EXPECT_GT(report.problems[0].offset, 8U);
}

}  // namespace
}  // namespace millrace::tools::recording
