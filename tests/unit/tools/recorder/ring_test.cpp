#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/mcap/file.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/recorder/alarms.hpp"
#include "tools/recorder/recorder.hpp"
#include "tools/recorder/series.hpp"

namespace millrace::tools::recorder {
namespace {

using fabric::Alarm;
using fabric::AlarmLevel;
using recording::Entry;
using recording::tests::at;
using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::uint64_t plenty = 1 << 20;

Entry entry(double milliseconds) {
  return {.at = at(milliseconds), .sample = recording::Withdrawal{}};
}

std::vector<fabric::Time> times(Ring& ring) {
  std::vector<fabric::Time> times;
  ring.take([&](const Entry& taken) { times.push_back(taken.at); });
  return times;
}

TEST(Ring, KeepsTheNewestInTheirOrder) {
  Ring sut(std::chrono::milliseconds(10), plenty);
  for (int i = 0; i <= 30; i += 5) {
    sut.add(entry(i));
  }
  EXPECT_EQ(times(sut), (std::vector{at(20), at(25), at(30)}));
  EXPECT_EQ(sut.count(), 0U);
}

TEST(Ring, RemovesTheOldestWhenTheMemoryIsFull) {
  Ring sut(std::chrono::hours(1), 10 * sizeof(Entry));
  for (int i = 0; i < 100; ++i) {
    sut.add(entry(i));
  }
  EXPECT_LE(sut.count(), 10U);
  EXPECT_EQ(times(sut).back(), at(99));
}

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

constexpr std::uint64_t mib = 1 << 20;

testing::Matcher<const Alarm&> is(AlarmLevel level, const std::string& text) {
  return AllOf(Field(&Alarm::level, level), Field(&Alarm::text, HasSubstr(text)));
}

Condition well() {
  return {
      .file = "run.mcap", .writes = "run-0003.mcap", .free = 900 * mib, .minimum_free = 100 * mib};
}

TEST(ARecorder, ReportsThatItRecordsAndWhereTo) {
  EXPECT_THAT(alarms_of(well()), ElementsAre(is(AlarmLevel::fine, "records to run-0003.mcap")));
}

TEST(ARecorder, ReportsThatItWaitsForAFailure) {
  Condition waiting = well();
  waiting.writes.reset();
  EXPECT_THAT(alarms_of(waiting),
              ElementsAre(is(AlarmLevel::fine, "writes run.mcap when a call fails")));
}

TEST(ARecorder, ReportsInTimeThatItsDiskFillsUnlessItMakesRoomItself) {
  Condition filling = well();
  filling.free = 150 * mib;
  EXPECT_THAT(alarms_of(filling),
              ElementsAre(is(AlarmLevel::fine, "records"),
                          is(AlarmLevel::warning, "less than 200.0 MiB left; at 100.0 MiB")));
  filling.makes_room = true;
  EXPECT_THAT(alarms_of(filling), ElementsAre(is(AlarmLevel::fine, "records")));
}

TEST(ARecorder, ReportsThatItRecordsNothingWithoutDiskSpace) {
  Condition full = well();
  full.writes.reset();
  full.free = 50 * mib;
  full.waits_for_room = true;
  EXPECT_THAT(alarms_of(full),
              ElementsAre(is(AlarmLevel::problem, "nothing is recorded: the disk of run.mcap")));
}

TEST(ARecorder, ReportsWhatIsMissing) {
  Condition lossy = well();
  lossy.missing = {.complete = 10, .incomplete = 2, .requests = 1, .events = 1};
  EXPECT_THAT(alarms_of(lossy), ElementsAre(is(AlarmLevel::fine, "records"),
                                            is(AlarmLevel::warning, "2 calls are incomplete")));
  lossy.missing = {};
  lossy.lost = 3;
  EXPECT_THAT(alarms_of(lossy), ElementsAre(is(AlarmLevel::fine, "records"),
                                            is(AlarmLevel::warning, "the bus lost 3 samples")));
}

}  // namespace
}  // namespace millrace::tools::recorder
