#include "tools/recording/timeline.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using testing::ElementsAre;
using tests::at;
using tests::one_call;

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

}  // namespace
}  // namespace millrace::tools::recording
