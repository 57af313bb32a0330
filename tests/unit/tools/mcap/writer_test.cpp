// The contents of a file at each step of the writer.
#include "tools/mcap/writer.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/mcap/sample_file.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/summary.hpp"

namespace millrace::tools::mcap {
namespace {

using tests::sample_file;
using tests::scan_all;

TEST(McapWriter, WritesMessagesThatAScanReadsBackInOrder) {
  const auto sample = sample_file(3, 4);
  const auto scanned = scan_all(sample.bytes);
  EXPECT_EQ(scanned.messages, sample.messages_within(sample.bytes.size()));
  EXPECT_EQ(scanned.problems, Problems{});
  EXPECT_EQ(scanned.metadata, 1U);
  EXPECT_EQ(scanned.attachments, 1U);
  EXPECT_TRUE(scanned.closed);
}

TEST(McapWriter, ClosesAFileWithoutMessages) {
  const auto scanned = scan_all(sample_file(0, 0).bytes);
  EXPECT_TRUE(scanned.closed);
  EXPECT_EQ(scanned.problems, Problems{});
}

TEST(McapWriter, HandsNothingOfAnOpenChunkToTheSink) {
  Memory file;
  Writer sut(file, {});
  sut.define(Channel{1, 0, "topic", "json", {}});
  ASSERT_TRUE(sut.write(Message{1, 1, 10, 10, "{}"}));
  EXPECT_EQ(file.size(), 0U);
  ASSERT_TRUE(sut.close_chunk());
  EXPECT_EQ(file.size(), sut.size());
  EXPECT_EQ(scan_all(file).messages.size(), 1U);
}

TEST(McapWriter, ClosesAChunkByItself) {
  Memory file;
  Writer sut(file, {.chunk_size = 1000});
  sut.define(Channel{1, 0, "topic", "json", {}});
  for (std::uint32_t i = 0; i < 100; ++i) {
    ASSERT_TRUE(sut.write(Message{1, i, i, i, std::string(50, 'x')}));
  }
  // 9 + 22 + 50 bytes each: 13 messages reach the limit, 9 are in the open chunk.
  EXPECT_EQ(sut.statistics().chunks, 100U / 13);
}

TEST(McapWriter, CountsPerChannel) {
  Memory file(sample_file(2, 5).bytes);
  const auto summary = read_summary(file);
  ASSERT_TRUE(summary);
  EXPECT_EQ(summary->statistics, (Statistics{.messages = 10,
                                             .schemas = 1,
                                             .channels = 2,
                                             .attachments = 1,
                                             .metadata = 1,
                                             .chunks = 2,
                                             .start = 1010,
                                             .end = 1100,
                                             .channel_messages = {{1, 5}, {2, 5}}}));
}

TEST(McapWriter, IndexesEachChunkByChannelAndTime) {
  Memory file(sample_file(2, 5).bytes);
  const auto summary = read_summary(file);
  ASSERT_TRUE(summary);
  ASSERT_EQ(summary->chunks.size(), 2U);
  const ChunkIndex& index = summary->chunks[1];
  EXPECT_EQ(index.start, 1060U);
  EXPECT_EQ(index.end, 1100U);
  EXPECT_EQ(index.message_index_offsets.size(), 2U);
  EXPECT_EQ(index.message_index_offsets.at(1), index.chunk_offset + index.chunk_length);
}

TEST(McapWriter, SumsUpEverythingBeforeTheEndOfTheData) {
  const auto sample = sample_file(2, 2);
  Memory file(sample.bytes);
  const std::uint64_t data_end = read_summary(file)->chunks.back().chunk_offset;
  const std::size_t end = sample.bytes.find("\x0f\x04\0\0\0\0\0\0\0", data_end, 9);
  ASSERT_NE(end, std::string::npos);
  const std::uint32_t crc = crc32(Bytes(sample.bytes).substr(0, end));
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(static_cast<std::uint8_t>(sample.bytes[end + 9 + i]),
              static_cast<std::uint8_t>(crc >> (8 * i)));
  }
}

TEST(McapWriter, PassesOnWhatTheSinkRefuses) {
  class Full : public Sink {
    tl::expected<void, std::string> write(Bytes) override {
      return tl::unexpected<std::string>("the disk is full");
    }
  } full;
  Writer sut(full, {});
  sut.define(Channel{1, 0, "topic", "json", {}});
  ASSERT_TRUE(sut.write(Message{1, 1, 10, 10, "{}"}));
  EXPECT_EQ(sut.close_chunk().error(), "the disk is full");
}

TEST(McapWriter, KeepsWhatTheSinkRefusesUntilItIsWritten) {
  class Narrow : public Memory {
   public:
    bool full = false;
    tl::expected<void, std::string> write(Bytes bytes) override {
      return full ? tl::unexpected<std::string>("the disk is full") : Memory::write(bytes);
    }
  } sink;
  Writer sut(sink, {});
  sut.define(Channel{1, 0, "topic", "json", {}});
  const auto write = [&](std::uint32_t number) {
    return sut.write(Message{1, number, 10 * number, 10 * number, "{}"});
  };
  ASSERT_TRUE(write(1));
  ASSERT_TRUE(sut.close_chunk());
  sink.full = true;
  ASSERT_TRUE(write(2));
  EXPECT_FALSE(sut.close_chunk());
  ASSERT_TRUE(write(3));
  EXPECT_FALSE(sut.close_chunk());
  EXPECT_EQ(sut.messages_taken(), 1U);
  EXPECT_FALSE(sut.close());
  sink.full = false;
  ASSERT_TRUE(sut.close());
  EXPECT_EQ(sut.messages_taken(), 3U);
  const Survey found = survey(sink);
  EXPECT_TRUE(found.problems.empty());
  EXPECT_EQ(found.summary.statistics.messages, 3U);
  const auto scanned = scan_all(sink);
  EXPECT_EQ(scanned.messages.size(), 3U);
  EXPECT_EQ(scanned.problems, Problems{});
}

// Summary and survey: the contents of a file without reading all of it.

TEST(McapSummary, ReadsOnlyTheEndsOfTheFile) {
  class Counting : public Memory {
   public:
    using Memory::Memory;
    void read(std::uint64_t offset, std::uint64_t length, std::string& out) override {
      Memory::read(offset, length, out);
      bytes_read += out.size();
    }
    std::size_t bytes_read = 0;
  };
  Counting file(sample_file(1, 20000).bytes);
  ASSERT_TRUE(read_summary(file));
  EXPECT_LT(file.bytes_read, 10000U);
  EXPECT_GT(file.size(), 1000000U);
}

TEST(McapSurvey, ReturnsTheSameWithAndWithoutSummary) {
  const auto sample = sample_file(3, 5);
  Memory whole(sample.bytes);
  const Survey by_summary = survey(whole);
  EXPECT_TRUE(by_summary.from_summary);

  std::string damaged_bytes = sample.bytes;
  damaged_bytes[damaged_bytes.size() - 60] ^= 1;  // inside the summary offsets
  Memory damaged(damaged_bytes);
  const Survey by_scan = survey(damaged);
  EXPECT_FALSE(by_scan.from_summary);
  EXPECT_EQ(by_scan.summary.statistics, by_summary.summary.statistics);
  EXPECT_EQ(by_scan.summary.header, by_summary.summary.header);
  EXPECT_EQ(by_scan.metadata, by_summary.metadata);
  ASSERT_EQ(by_scan.problems.size(), 1U);
  EXPECT_EQ(by_scan.problems[0].text, "the summary is damaged: its CRC is wrong");
}

TEST(McapSurvey, ReportsTheCompressionOfChunks) {
  const auto sample = sample_file(3, 100, Compression::zstd);
  Memory whole(sample.bytes);
  const Survey by_summary = survey(whole);
  ASSERT_EQ(by_summary.chunk_sizes.size(), 1U);
  const ChunkSizes sizes = by_summary.chunk_sizes.at("zstd");
  EXPECT_EQ(sizes.chunks, 3U);
  EXPECT_LT(sizes.stored, sizes.uncompressed / 2);
  EXPECT_LT(sample.bytes.size(), sample_file(3, 100).bytes.size());

  Memory cut(sample.bytes.substr(0, sample.chunk_ends.back()));
  EXPECT_EQ(survey(cut).chunk_sizes, by_summary.chunk_sizes);
}

TEST(McapSurvey, ReportsOnceThatAFileWasNotClosed) {
  auto sample = sample_file(2, 5);
  sample.bytes.resize(sample.chunk_ends.back());
  Memory file(sample.bytes);
  const Survey found = survey(file);
  ASSERT_EQ(found.problems.size(), 1U);
  EXPECT_EQ(found.problems[0].to_string(), "at byte " + std::to_string(sample.bytes.size()) +
                                               ": the file ends here: it was never closed");
  EXPECT_EQ(found.summary.statistics.messages, 10U);
}

}  // namespace
}  // namespace millrace::tools::mcap
