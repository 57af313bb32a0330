// Summary and survey: the contents of a file without reading all of it.
#include "tools/mcap/summary.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/mcap/sample_file.hpp"

namespace millrace::tools::mcap {
namespace {

using tests::sample_file;

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
