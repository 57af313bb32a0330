#include "tools/recorder/alarms.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tools::recorder {
namespace {

using fabric::Alarm;
using fabric::AlarmLevel;
using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

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
