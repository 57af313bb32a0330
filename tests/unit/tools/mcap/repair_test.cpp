// The recorder's guarantee: a closed chunk survives any end of the file.
#include "tools/mcap/repair.hpp"

#include <gtest/gtest.h>

#include "tests/unit/tools/mcap/sample_file.hpp"
#include "tools/mcap/summary.hpp"

namespace millrace::tools::mcap {
namespace {

using tests::sample_file;
using tests::scan_all;

class McapRepairOf : public testing::TestWithParam<Compression> {};

INSTANTIATE_TEST_SUITE_P(Each, McapRepairOf,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& of) {
                           return of.param == Compression::none ? "none"
                                                                : std::string(name_of(of.param));
                         });

TEST_P(McapRepairOf, RestoresEveryMessageOfEveryWholeChunkWhereverTheFileIsCut) {
  const auto sample = sample_file(4, 3, GetParam());
  for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
    Memory damaged(sample.bytes.substr(0, size));
    Memory repaired;
    const auto report = repair(damaged, repaired, "test");
    ASSERT_TRUE(report);
    ASSERT_FALSE(report->problems.empty()) << "cut at " << size;

    const auto scanned = scan_all(repaired);
    ASSERT_EQ(scanned.messages, sample.messages_within(size)) << "cut at " << size;
    ASSERT_EQ(scanned.problems, Problems{}) << "cut at " << size;
    ASSERT_TRUE(scanned.closed);
    const auto summary = read_summary(repaired);
    ASSERT_TRUE(summary) << summary.error().to_string();
    ASSERT_EQ(summary->statistics, report->saved);
  }
}

TEST_P(McapRepairOf, LeavesWhatWasCompressedCompressed) {
  Memory whole(sample_file(2, 300, GetParam()).bytes);
  Memory repaired;
  ASSERT_TRUE(repair(whole, repaired, "test"));
  const auto found = survey(repaired);
  EXPECT_EQ(found.summary.statistics.messages, 600U);
  ASSERT_EQ(found.chunk_sizes.size(), 1U);
  EXPECT_EQ(found.chunk_sizes.begin()->first, name_of(GetParam()));
}

TEST(McapRepair, LeavesAWholeFileWhole) {
  const auto sample = sample_file(3, 3);
  Memory whole(sample.bytes);
  Memory repaired;
  const auto report = repair(whole, repaired, "test");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->problems, Problems{});
  EXPECT_EQ(report->saved.attachments, 1U);
  EXPECT_EQ(report->saved.metadata, 1U);
  EXPECT_EQ(scan_all(repaired).messages, sample.messages_within(sample.bytes.size()));
}

TEST(McapRepair, ReportsTheSinksError) {
  class Full : public Sink {
    tl::expected<void, std::string> write(Bytes) override {
      return tl::unexpected<std::string>("the disk is full");
    }
  } full;
  Memory damaged(sample_file(1, 1).bytes);
  EXPECT_EQ(repair(damaged, full, "test").error(), "the disk is full");
}

TEST(McapRepair, RefusesAFileThatIsNoRecording) {
  for (const char* const text : {"no recording", "id,at,machine\r\n1,2,3\r\n"}) {
    Memory foreign{std::string(text)};
    Memory repaired;
    const auto report = repair(foreign, repaired, "test");
    ASSERT_FALSE(report) << text;
    EXPECT_NE(report.error().find("it is not a recording"), std::string::npos);
    EXPECT_EQ(repaired.size(), 0U);
  }
}

}  // namespace
}  // namespace millrace::tools::mcap
