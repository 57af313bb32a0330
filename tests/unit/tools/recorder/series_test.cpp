#include "tools/recorder/series.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"
#include "tools/mcap/file.hpp"
#include "tools/mcap/repair.hpp"

namespace millrace::tools::recorder {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class SeriesTest : public testing::Test {
 protected:
  void make(const std::string& name, int hours_ago = 0) {
    std::ofstream(folder.path() / name) << name;
    std::filesystem::last_write_time(
        folder.path() / name,
        std::filesystem::file_time_type::clock::now() - std::chrono::hours(hours_ago));
  }
  [[nodiscard]] std::filesystem::path path(const std::string& name) const {
    return folder.path() / name;
  }

  tests::TemporaryFolder folder;
};

TEST_F(SeriesTest, NumbersItsFiles) {
  EXPECT_EQ(Series("a/run.mcap", Series::Files::one).numbered(1), "a/run.mcap");
  EXPECT_EQ(Series("a/run.mcap", Series::Files::many).numbered(7), "a/run-0007.mcap");
}

TEST_F(SeriesTest, FindsItsOwnFiles) {
  for (const char* name : {"run-0001.mcap", "run-0002.repaired.mcap", "run-0011.mcap.part",
                           "runs-0099.mcap", "run-x.mcap", "run-0098.txt"}) {
    make(name);
  }
  const Series sut(path("run.mcap"), Series::Files::many);
  EXPECT_EQ(sut.last_number(), 11U);
  EXPECT_EQ(sut.closed().size(), 2U);
  EXPECT_THAT(sut.leftovers(), ElementsAre(path("run-0011.mcap.part")));
}

TEST_F(SeriesTest, FindsFilesThatWereRepairedHoweverOften) {
  for (const char* name :
       {"run.repaired.mcap", "run.repaired-2.mcap", "run.repaired-x.mcap", "run.repairedly.mcap"}) {
    make(name);
  }
  EXPECT_EQ(Series(path("run.mcap"), Series::Files::one).closed().size(), 2U);
  EXPECT_EQ(mcap::free_repaired_name(path("run.mcap.part")), path("run.repaired-3.mcap"));
}

TEST_F(SeriesTest, HasTheOldestFirst) {
  make("run-0001.mcap", 1);
  make("run-0002.mcap", 3);
  make("run-0003.mcap", 2);
  EXPECT_THAT(Series(path("run.mcap"), Series::Files::many).closed(),
              ElementsAre(path("run-0002.mcap"), path("run-0003.mcap"), path("run-0001.mcap")));
}

TEST_F(SeriesTest, TreatsRecordingsNamedByTimeAsOneSeries) {
  make("millrace-20260301T070000Z-0001.mcap", 2);
  make("millrace-20260302T070000Z.mcap.part");
  make("millrace-notes.mcap");
  const Series sut(path("millrace-20260303T070000Z.mcap"), Series::Files::many, "millrace-");
  EXPECT_EQ(sut.last_number(), 0U);
  EXPECT_THAT(sut.closed(), ElementsAre(path("millrace-20260301T070000Z-0001.mcap")));
  EXPECT_THAT(sut.leftovers(), ElementsAre(path("millrace-20260302T070000Z.mcap.part")));
}

TEST_F(SeriesTest, LeavesAFileAloneThatIsBeingWritten) {
  auto writing = mcap::FileSink::create(path("run-0001.mcap"));
  ASSERT_TRUE(writing);
  const Series sut(path("run.mcap"), Series::Files::many);
  EXPECT_THAT(sut.leftovers(), IsEmpty());
  { const mcap::FileSink left = std::move(*writing); }
  EXPECT_THAT(sut.leftovers(), ElementsAre(path("run-0001.mcap.part")));
}

}  // namespace
}  // namespace millrace::tools::recorder
