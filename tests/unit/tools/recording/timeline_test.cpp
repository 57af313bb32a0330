#include "tools/recording/timeline.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recording/entry.hpp"
#include "tools/recording/hops.hpp"

namespace millrace::tools::recording {
namespace {

using testing::ElementsAre;
using tests::at;
using tests::one_call;
using tests::square_root;

std::vector<Stage> stages(const Timeline& timeline) {
  std::vector<Stage> stages;
  for (const Step& step : timeline.steps) {
    stages.push_back(step.stage);
  }
  return stages;
}

Timeline timeline_of(const std::vector<Entry>& entries) {
  Call call({0x5f, 17});
  for (const Entry& entry : entries) {
    call.add(entry);
  }
  return recording::timeline_of(call);
}

TEST(Timeline, ShowsEachHopOnce) {
  const Timeline timeline = timeline_of(one_call(17, 0));
  EXPECT_THAT(stages(timeline),
              ElementsAre(Stage::seen, Stage::dispatched, Stage::received, Stage::started,
                          Stage::answered, Stage::replied, Stage::written));
  EXPECT_EQ(timeline.key, (fabric::ChannelKey{"cnc", 1}));
  EXPECT_EQ(timeline.uuid, tests::square_root);
  EXPECT_EQ(timeline.steps.front().text, "2");
  EXPECT_EQ(timeline.steps.back().at, at(7.1));
  EXPECT_EQ(timeline.clock_difference, std::chrono::nanoseconds{});
}

TEST(Timeline, IsTheSameWhateverTheOrderOfTheSamples) {
  std::vector<Entry> entries = one_call(17, 0);
  const auto expected = stages(timeline_of(entries));
  std::reverse(entries.begin(), entries.end());
  EXPECT_EQ(stages(timeline_of(entries)), expected);
}

TEST(Timeline, KeepsTheOrderOfHopsWhenTheServicesClockDiffers) {
  for (const double ahead : {-1000.0, 1000.0}) {
    const Timeline timeline = timeline_of(one_call(17, 0, ahead));
    EXPECT_THAT(stages(timeline),
                ElementsAre(Stage::seen, Stage::dispatched, Stage::received, Stage::started,
                            Stage::answered, Stage::replied, Stage::written));
    EXPECT_EQ(timeline.steps[2].at, at(1.5 + ahead));
    EXPECT_GT(std::chrono::abs(timeline.clock_difference), std::chrono::milliseconds(990));
  }
}

TEST(Timeline, IgnoresOtherCalls) {
  EXPECT_TRUE(timeline_of(one_call(18, 0)).steps.empty());
}

TEST(Timeline, ShowsAttemptsOneAfterTheOther) {
  std::vector<Entry> entries = one_call(17, 0);
  entries.resize(3);  // seen, request, dispatched
  Entry lost = entries[2];
  std::get<fabric::Event>(lost.sample).kind = fabric::EventKind::lost;
  std::get<fabric::Event>(lost.sample).at = at(500);
  entries.push_back(lost);
  for (Entry entry : one_call(17, 1000)) {
    if (auto* request = std::get_if<fabric::Request>(&entry.sample)) {
      request->attempt = 2;
    } else if (auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
      reply->attempt = 2;
    } else if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      if (event->kind == fabric::EventKind::seen) {
        continue;
      }
      event->attempt = 2;
    }
    entries.push_back(entry);
  }
  const Timeline timeline = timeline_of(entries);
  EXPECT_THAT(stages(timeline), ElementsAre(Stage::seen, Stage::dispatched, Stage::lost,
                                            Stage::dispatched, Stage::received, Stage::started,
                                            Stage::answered, Stage::replied, Stage::written));
  EXPECT_EQ(timeline.steps[3].attempt, 2U);
}

// A regression: the operator's answer was taken for the service's, and the timeline reported that
// the clocks differ by the ten seconds in between.
TEST(Timeline, PutsAReplyThatComesAfterAnOperatorsAnswerBehindItAndKeepsTheClocks) {
  std::vector<Entry> entries = one_call(17, 0);
  Entry late = entries[4];
  for (Entry& entry : entries) {
    if (auto* const reply = std::get_if<fabric::Reply>(&entry.sample)) {
      reply->answered = at(10'000);
    } else if (auto* const event = std::get_if<fabric::Event>(&entry.sample);
               event != nullptr && (event->kind == fabric::EventKind::replied ||
                                    event->kind == fabric::EventKind::written)) {
      event->instance = {};
      event->at = at(event->kind == fabric::EventKind::replied ? 2 : 3);
    }
  }
  std::get<fabric::Event>(late.sample).kind = fabric::EventKind::late;
  std::get<fabric::Event>(late.sample).at = at(10'000.5);
  entries.push_back(late);
  const Timeline timeline = timeline_of(entries);
  EXPECT_EQ(timeline.clock_difference, std::chrono::nanoseconds{});
  EXPECT_THAT(stages(timeline),
              ElementsAre(Stage::seen, Stage::dispatched, Stage::received, Stage::started,
                          Stage::replied, Stage::written, Stage::answered, Stage::late));
}

TEST(Timeline, BoundsWhatAnInstanceDidByTheSameAttemptAlone) {
  std::vector<Entry> entries = one_call(17, 0);
  // The outcome of the first attempt is not that of the second, which the same instance got later.
  for (Entry entry : one_call(17, 1000)) {
    if (auto* request = std::get_if<fabric::Request>(&entry.sample)) {
      request->attempt = 2;
    } else if (auto* event = std::get_if<fabric::Event>(&entry.sample)) {
      event->attempt = event->kind == fabric::EventKind::seen ? 0 : 2;
    } else if (auto* reply = std::get_if<fabric::Reply>(&entry.sample)) {
      reply->attempt = 2;
    }
    entries.push_back(entry);
  }
  EXPECT_EQ(timeline_of(entries).clock_difference, std::chrono::nanoseconds{});
}

double milliseconds(const HopStatistics& hops, Hop hop) {
  const Histogram& times = hops.services().at(square_root).at(static_cast<std::size_t>(hop));
  return std::chrono::duration<double, std::milli>(times.max()).count();
}

void add_all(HopStatistics& sut, const std::vector<Entry>& entries) {
  for (const Entry& entry : entries) {
    sut.add(entry);
  }
}

TEST(HopStatistics, MeasuresEachHop) {
  HopStatistics sut;
  add_all(sut, one_call(1, 0));
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::dispatch), 1);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::to_service), 0.5);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::queue), 0.1);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::work), 3);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::to_gateway), 0.5);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::write_back), 2);
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
}

TEST(HopStatistics, IgnoresTheOrderOfTheSamplesOfACall) {
  const std::vector<Entry> entries = one_call(1, 0);
  // All orders of request, reply and the three events with their own times.
  std::vector<std::size_t> order{0, 1, 3, 4, 5};
  do {
    HopStatistics sut;
    for (const std::size_t i : order) {
      sut.add(entries[i]);
    }
    sut.close();
    ASSERT_EQ(sut.services().at(square_root).back().count(), 1U);
    ASSERT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
    ASSERT_DOUBLE_EQ(milliseconds(sut, Hop::dispatch), 1);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(HopStatistics, CountsACallThatAnOperatorAnsweredWhenTheRecordingEnds) {
  std::vector<Entry> entries = one_call(1, 0);
  entries.erase(entries.begin() + 3);  // no reply
  HopStatistics sut;
  add_all(sut, entries);
  EXPECT_TRUE(sut.services().empty());
  sut.close();
  EXPECT_DOUBLE_EQ(milliseconds(sut, Hop::total), 7.1);
}

TEST(HopStatistics, LeavesWithdrawnCallsOut) {
  std::vector<Entry> entries = one_call(1, 0);
  std::get<fabric::Event>(entries[5].sample).kind = fabric::EventKind::withdrawn;
  HopStatistics sut;
  add_all(sut, entries);
  sut.close();
  EXPECT_TRUE(sut.services().empty());
}

TEST(HopStatistics, CountsCallsThatHaveEndedAndThoseThatFailed) {
  HopStatistics sut;
  add_all(sut, one_call(1, 0));
  add_all(sut, one_call(2, 10));
  sut.add(one_call(2, 10).back());  // a gateway that resumes repeats the end
  std::vector<Entry> withdrawn = one_call(3, 20);
  std::get<fabric::Event>(withdrawn[5].sample).kind = fabric::EventKind::withdrawn;
  add_all(sut, withdrawn);
  sut.add(one_call(4, 30)[1]);  // under way
  EXPECT_EQ(sut.ended(), 3U);
  EXPECT_EQ(sut.failed(), 1U);
  sut.close();
  EXPECT_EQ(sut.ended(), 3U);
  EXPECT_EQ(sut.failed(), 1U);
}

TEST(HopStatistics, ForgetsCallsThatNeverEnd) {
  HopStatistics sut;
  for (std::uint64_t number = 1; number <= 10000; ++number) {
    sut.add(one_call(number, 0)[1]);
  }
  add_all(sut, one_call(20000, 0));
  EXPECT_EQ(sut.services().at(square_root).back().count(), 1U);
}

TEST(HopStatistics, ForgetsTheOldestCallWhateverTheNumbersOfItsGateway) {
  HopStatistics sut;
  for (std::uint64_t number = 1; number <= 5000; ++number) {
    Entry begun = one_call(number, 0)[1];
    std::get<fabric::Request>(begun.sample).call.epoch = 0xffff;
    sut.add(begun);
  }
  // Of a gateway whose epoch is lower than all others.
  for (std::uint64_t number = 1; number <= 100; ++number) {
    add_all(sut, one_call(number, 0));
  }
  EXPECT_EQ(sut.services().at(square_root).back().count(), 100U);
}

const Entry request = one_call(17, 0)[1];
const Entry of_an_instance{.uuid = tests::square_root, .sample = InstanceNews{}};

TEST(RecordingFilter, AcceptsEverythingByDefault) {
  EXPECT_TRUE(Filter{}.takes(request));
  EXPECT_TRUE(Filter{}.takes(of_an_instance));
}

TEST(RecordingFilter, ChoosesByMachineAndChannel) {
  EXPECT_TRUE((Filter{.machines = {"cnc", "press"}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"press"}}.takes(request)));
  EXPECT_TRUE((Filter{.machines = {"cnc"}, .channels = {1}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"cnc"}, .channels = {2}}.takes(request)));
  EXPECT_FALSE((Filter{.machines = {"cnc"}}.takes(of_an_instance)));
}

TEST(RecordingFilter, ChoosesByServiceKindAndCall) {
  EXPECT_TRUE((Filter{.uuids = {tests::square_root}}.takes(of_an_instance)));
  EXPECT_FALSE((Filter{.uuids = {"other"}}.takes(request)));
  EXPECT_TRUE((Filter{.kinds = {"request"}}.takes(request)));
  EXPECT_FALSE((Filter{.kinds = {"reply"}}.takes(request)));
  EXPECT_TRUE((Filter{.call = fabric::CallId{0x5f, 17}}.takes(request)));
  EXPECT_FALSE((Filter{.call = fabric::CallId{0x5f, 18}}.takes(request)));
}

TEST(RecordingFilter, ChoosesByTimeOfRecording) {
  EXPECT_TRUE((Filter{.from = at(1.1), .to = at(1.1)}.takes(request)));
  EXPECT_FALSE((Filter{.from = at(1.2)}.takes(request)));
  EXPECT_FALSE((Filter{.to = at(1)}.takes(request)));
}

}  // namespace
}  // namespace millrace::tools::recording
