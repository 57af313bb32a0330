#include "tools/replay/scheduler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/replay/sample_plan.hpp"

namespace millrace::tools::replay {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::size_t> all_due(Scheduler& sut, nanoseconds now) {
  std::vector<std::size_t> due;
  while (const auto call = sut.next(now)) {
    due.push_back(*call);
  }
  return due;
}

TEST(Scheduler, IssuesEachCallAtItsTime) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 10ms, 5ms), planned(1, 20ms, 5ms)}, {}};
  Scheduler sut(plan, {});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0));
  EXPECT_EQ(sut.next_time(), 10ms);
  EXPECT_THAT(all_due(sut, 9ms), IsEmpty());
  EXPECT_THAT(all_due(sut, 10ms), ElementsAre(1));
  sut.ended(0);
  EXPECT_EQ(sut.next_time(), 20ms);
  EXPECT_THAT(all_due(sut, 20ms), ElementsAre(2));
  EXPECT_FALSE(sut.done());
  sut.ended(1);
  sut.ended(2);
  EXPECT_TRUE(sut.done());
}

TEST(Scheduler, IsFasterAndSlowerByTheRate) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 100ms, 5ms)}, {}};
  Scheduler fast(plan, {.rate = 10});
  EXPECT_THAT(all_due(fast, 10ms), ElementsAre(0, 1));
  Scheduler slow(plan, {.rate = 0.5});
  EXPECT_THAT(all_due(slow, 199ms), ElementsAre(0));
  EXPECT_EQ(slow.next_time(), 200ms);
}

TEST(Scheduler, HasOneCallAtATimeInEachChannel) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(1, 10ms, 5ms), planned(2, 11ms, 5ms)}, {}};
  Scheduler sut(plan, {});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0));
  // The first one takes longer than in the recording.
  EXPECT_THAT(all_due(sut, 30ms), ElementsAre(2));
  EXPECT_EQ(sut.next_time(), std::nullopt);
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 30ms), ElementsAre(1));
  EXPECT_TRUE(sut.was_held_up(1));
  EXPECT_FALSE(sut.was_held_up(2));
}

TEST(Scheduler, GoesFastWithoutRunningAtOnceWhatRanOneAfterTheOther) {
  // Channel 2 calls while channel 1's first call runs, and again after it has ended.
  const Plan plan{{planned(1, 0ms, 50ms), planned(2, 10ms, 5ms), planned(2, 100ms, 5ms)}, {}};
  Scheduler sut(plan, {.timing = Timing::fast});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0, 1));
  sut.ended(1);
  EXPECT_THAT(all_due(sut, 0ms), IsEmpty());
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(2));
}

TEST(Scheduler, DoesNotWaitForACallThatNeverEndedInTheRecording) {
  Plan plan{{planned(1, 0ms, 50ms), planned(2, 100ms, 5ms)}, {}};
  plan.calls[0].answer.reset();
  Scheduler sut(plan, {.timing = Timing::fast});
  EXPECT_THAT(all_due(sut, 0ms), ElementsAre(0, 1));
}

TEST(Scheduler, StepsWhenItIsAllowed) {
  const Plan plan{{planned(1, 0ms, 5ms), planned(2, 1ms, 5ms)}, {}};
  Scheduler sut(plan, {.timing = Timing::step});
  EXPECT_THAT(all_due(sut, 1s), IsEmpty());
  sut.allow();
  sut.allow();
  EXPECT_THAT(all_due(sut, 1s), ElementsAre(0));
  sut.ended(0);
  EXPECT_THAT(all_due(sut, 1s), ElementsAre(1));
}

TEST(Scheduler, GoesThroughALongPlanInOrderOfEachChannelWhateverTheEnds) {
  Plan plan;
  for (int i = 0; i < 1000; ++i) {
    plan.calls.push_back(
        planned(static_cast<std::uint16_t>(1 + i * 7 % 5), std::chrono::milliseconds(i), 3ms));
  }
  for (const Timing timing : {Timing::timed, Timing::fast}) {
    Scheduler sut(plan, {.timing = timing});
    std::map<fabric::ChannelKey, std::size_t> last;
    std::vector<std::size_t> open;
    nanoseconds now{};
    while (!sut.done()) {
      for (const std::size_t call : all_due(sut, now)) {
        const auto [place, first] = last.try_emplace(plan.calls[call].channel, call);
        EXPECT_TRUE(first || place->second < call);
        place->second = call;
        open.push_back(call);
      }
      now += 700us;
      if (!open.empty()) {
        // The newest ends first.
        sut.ended(open.back());
        open.pop_back();
      }
    }
    EXPECT_EQ(sut.issued(), 1000U);
  }
}

}  // namespace
}  // namespace millrace::tools::replay
