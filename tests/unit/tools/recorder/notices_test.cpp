#include "tools/recorder/notices.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tools::recorder {
namespace {

using fabric::Notice;
using fabric::NoticeLevel;
using testing::AllOf;
using testing::ElementsAre;
using testing::Field;
using testing::HasSubstr;

constexpr std::uint64_t mib = 1 << 20;

testing::Matcher<const Notice&> is(NoticeLevel level, const std::string& text) {
  return AllOf(Field(&Notice::level, level), Field(&Notice::text, HasSubstr(text)));
}

Condition well() {
  return {
      .file = "run.mcap", .writes = "run-0003.mcap", .free = 900 * mib, .minimum_free = 100 * mib};
}

TEST(ARecorder, SaysThatItRecordsAndWhereTo) {
  EXPECT_THAT(notices_of(well()), ElementsAre(is(NoticeLevel::fine, "records to run-0003.mcap")));
}

TEST(ARecorder, SaysThatItWaitsForAFailure) {
  Condition waiting = well();
  waiting.writes.reset();
  EXPECT_THAT(notices_of(waiting),
              ElementsAre(is(NoticeLevel::fine, "will write run.mcap when a call fails")));
}

TEST(ARecorder, SaysInTimeThatItsDiskFillsUnlessItMakesRoomItself) {
  Condition filling = well();
  filling.free = 150 * mib;
  EXPECT_THAT(notices_of(filling),
              ElementsAre(is(NoticeLevel::fine, "records"),
                          is(NoticeLevel::warning, "less than 200.0 MiB left; at 100.0 MiB")));
  filling.makes_room = true;
  EXPECT_THAT(notices_of(filling), ElementsAre(is(NoticeLevel::fine, "records")));
}

TEST(ARecorder, SaysThatItRecordsNothingForWantOfRoom) {
  Condition full = well();
  full.writes.reset();
  full.free = 50 * mib;
  full.waits_for_room = true;
  EXPECT_THAT(notices_of(full),
              ElementsAre(is(NoticeLevel::problem, "nothing is recorded: the disk of run.mcap")));
}

TEST(ARecorder, SaysWhatIsMissing) {
  Condition lossy = well();
  lossy.missing = {.complete = 10, .incomplete = 2, .requests = 1, .events = 1};
  EXPECT_THAT(notices_of(lossy),
              ElementsAre(is(NoticeLevel::fine, "records"),
                          is(NoticeLevel::warning, "of 2 calls something is missing")));
  lossy.missing = {};
  lossy.lost = 3;
  EXPECT_THAT(notices_of(lossy), ElementsAre(is(NoticeLevel::fine, "records"),
                                             is(NoticeLevel::warning, "the bus lost 3 samples")));
}

}  // namespace
}  // namespace millrace::tools::recorder
