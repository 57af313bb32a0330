#include "tools/replay/data_plan.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::replay {
namespace {

using fabric::ProgramEvent;
using fabric::ProgramEventKind;
using recording::Entry;
using recording::tests::at;
using std::chrono::milliseconds;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

const fabric::ChannelKey press{"press", 1};
const fabric::ChannelKey test{"test", 7};

fabric::DataSample sample(double ms) {
  return {.key = press,
          .group = "axes",
          .at = at(ms),
          .values = {{.name = "X", .at = at(ms - 5), .elements = std::vector<double>{1}}}};
}

ProgramEvent event(ProgramEventKind kind, double ms, double started) {
  return {.key = press, .kind = kind, .at = at(ms), .started = at(started)};
}

DataPlan plan_of(const std::vector<double>& times, Pace pace = {}, milliseconds max_gap = {}) {
  DataPlan plan(pace, max_gap);
  for (const double ms : times) {
    plan.add(Entry{.at = at(ms), .sample = sample(ms)});
  }
  return plan;
}

TEST(ADataPlan, CountsWhatItIsAbout) {
  DataPlan sut({});
  sut.add({.at = at(0), .sample = sample(0)});
  sut.add({.at = at(1), .sample = event(ProgramEventKind::ended, 1, 0)});
  sut.add({.at = at(2), .sample = fabric::Request{.key = {"other", 1}}});
  EXPECT_EQ(sut.samples(), 1U);
  EXPECT_EQ(sut.events(), 1U);
  EXPECT_THAT(sut.channels(), ElementsAre(press));
}

TEST(ADataPlan, KeepsTheRecordedTiming) {
  const DataPlan sut = plan_of({1000, 1100, 1300});
  EXPECT_EQ(sut.due(at(1000)), milliseconds(0));
  EXPECT_EQ(sut.due(at(1300)), milliseconds(300));
}

TEST(ADataPlan, IsFasterOnRequest) {
  EXPECT_EQ(plan_of({1000, 1300}, {.rate = 10}).due(at(1300)), milliseconds(30));
  EXPECT_EQ(plan_of({1000, 1300}, {.timing = Timing::fast}).due(at(1300)), milliseconds(0));
}

TEST(ADataPlan, CutsLongTimesWithoutAnything) {
  const DataPlan sut = plan_of({0, 100, 60'100, 60'200}, {}, milliseconds(1000));
  EXPECT_EQ(sut.due(at(100)), milliseconds(100));
  EXPECT_EQ(sut.due(at(60'100)), milliseconds(1100));
  EXPECT_EQ(sut.due(at(60'200)), milliseconds(1200));
}

TEST(ADataPlan, MovesAllTimesOfASampleToWhenItIsSent) {
  const DataPlan plan = plan_of({1000, 3000}, {.rate = 2});
  const fabric::DataSample sut = plan.replayed(sample(3000), test, at(100'000));
  EXPECT_EQ(sut.key, test);
  EXPECT_TRUE(sut.replayed);
  EXPECT_EQ(sut.at, at(101'000));
  EXPECT_EQ(sut.values.at(0).at, at(101'000 - 2.5));
  fabric::DataSample never = sample(3000);
  never.values.at(0).at = {};
  EXPECT_EQ(plan.replayed(never, test, at(100'000)).values.at(0).at, fabric::Time{});
}

TEST(ADataPlan, KeepsTheSameStartInEachEventOfARun) {
  const DataPlan plan = plan_of({1000, 60'000}, {.rate = 3}, milliseconds(500));
  const auto started =
      plan.replayed(event(ProgramEventKind::started, 1000, 1000), test, at(100'000));
  const auto ended = plan.replayed(event(ProgramEventKind::ended, 60'000, 1000), test, at(100'000));
  EXPECT_EQ(started.at, at(100'000));
  EXPECT_EQ(ended.started, started.at);
}

TEST(ADataPlan, SendsNothingFromTheFutureWhenItIsFast) {
  const DataPlan plan = plan_of({1000, 3000}, {.timing = Timing::fast});
  EXPECT_EQ(plan.replayed(sample(3000), test, at(100'000)).at, at(100'000));
  EXPECT_EQ(plan.replayed(sample(1000), test, at(100'000)).at, at(98'000));
}

TEST(ValuesOfAReplay, AreRetracted) {
  PublishedValues sut;
  sut.add(sample(0));
  sut.add(sample(100));
  sut.add(event(ProgramEventKind::started, 0, 0));
  ASSERT_THAT(sut.groups(), SizeIs(1));
  EXPECT_EQ(sut.groups().at(0).group, "axes");
  ASSERT_THAT(sut.resets(at(500)), SizeIs(1));
  EXPECT_EQ(sut.resets(at(500)).at(0).kind, ProgramEventKind::reset);
  EXPECT_EQ(sut.resets(at(500)).at(0).at, at(500));
  EXPECT_EQ(sut.resets(at(500)).at(0).started, at(0));

  sut.add(event(ProgramEventKind::ended, 100, 0));
  EXPECT_THAT(sut.resets(at(500)), IsEmpty());
  EXPECT_THAT(sut.programs(), SizeIs(1));
  fabric::DataSample gone = sample(200);
  gone.values.clear();
  sut.add(gone);
  EXPECT_THAT(sut.groups(), IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::replay
