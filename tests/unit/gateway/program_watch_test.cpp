#include "gateway/programs/program_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway::programs {
namespace {

using namespace std::chrono_literals;
using fabric::DataSample;
using fabric::ProgramEvent;
using fabric::ProgramEventKind;
using fabric::Quality;
using fabric::Time;
using fabric::Value;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::int64_t standby = 1;
constexpr std::int64_t automatic = 2;
constexpr std::int64_t selected = 2;
constexpr std::int64_t ready = 3;
constexpr std::int64_t active = 4;
constexpr std::int64_t hold = 5;
constexpr std::int64_t error = 6;

class AProgramWatch : public testing::Test {
 protected:
  Value integer(const std::string& called, std::int64_t value) {
    return {.name = called,
            .type = fabric::ValueType::uns32,
            .elements = std::vector<std::int64_t>{value}};
  }

  /// A second later, the channel has this state.
  std::vector<ProgramEventKind> see(std::int64_t state, std::int64_t mode = automatic) {
    now += 1s;
    DataSample sample{.key = {"press", 1}, .group = programs_group, .at = now};
    sample.values = {integer("state", state),
                     integer("mode", mode),
                     {.name = "NAME", .elements = std::vector<std::string>{name}},
                     integer("ERROR", 21462),
                     integer("PARTS", parts)};
    return take(sut.on_sample(sample));
  }
  std::vector<ProgramEventKind> lose_link() {
    now += 1s;
    DataSample sample{.key = {"press", 1}, .group = programs_group, .at = now};
    sample.values = {integer("state", active)};
    sample.values[0].quality = Quality::stale;
    return take(sut.on_sample(sample));
  }
  std::vector<ProgramEventKind> take(const std::vector<ProgramEvent>& events) {
    std::vector<ProgramEventKind> kinds;
    for (const ProgramEvent& event : events) {
      kinds.push_back(event.kind);
      last = event;
    }
    return kinds;
  }

  ProgramWatch sut{{"press", 1}, {.name = "NAME", .error = "ERROR", .counter = "PARTS"}};
  Time now{1'700'000'000s};
  std::string name = "demo.nc";
  std::int64_t parts = 7;
  ProgramEvent last;
};

TEST_F(AProgramWatch, ReportsAStartAndAnEndWithNameDurationAndParts) {
  EXPECT_THAT(see(selected), IsEmpty());
  EXPECT_THAT(see(ready), IsEmpty());
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::started));
  EXPECT_EQ(last.program, "demo.nc");
  EXPECT_EQ(last.parts, 7);
  const Time start = now;
  EXPECT_THAT(see(active), IsEmpty());
  parts = 8;
  name.clear();

  EXPECT_THAT(see(selected), ElementsAre(ProgramEventKind::ended));

  EXPECT_EQ(last.key, (fabric::ChannelKey{"press", 1}));
  EXPECT_EQ(last.program, "demo.nc");
  EXPECT_EQ(last.started, start);
  EXPECT_EQ(last.at - last.started, 2s);
  EXPECT_EQ(last.parts, 8);
  EXPECT_EQ(last.mode, 2U);
  EXPECT_EQ(last.error, 0U);
}

TEST_F(AProgramWatch, AcceptsEitherStateAfterAnEnd) {
  see(selected);
  see(active);
  EXPECT_THAT(see(ready), ElementsAre(ProgramEventKind::ended));
}

TEST_F(AProgramWatch, ReportsAnErrorWithItsNumber) {
  see(ready);
  see(active);
  EXPECT_THAT(see(error), ElementsAre(ProgramEventKind::aborted));
  EXPECT_EQ(last.error, 21462U);
  EXPECT_EQ(last.at - last.started, 1s);
}

TEST_F(AProgramWatch, ReportsThatAnErrorIsClearedUnlessAProgramStarts) {
  see(ready);
  see(active);
  const Time start = now;
  see(error);
  EXPECT_THAT(see(error), IsEmpty());
  EXPECT_THAT(see(selected), ElementsAre(ProgramEventKind::reset));
  EXPECT_EQ(last.started, start);
  EXPECT_EQ(last.program, "demo.nc");
  EXPECT_THAT(see(error), ElementsAre(ProgramEventKind::aborted));
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::started));
}

TEST_F(AProgramWatch, ReportsAnErrorOfAProgramWhoseRunItDidNotSee) {
  see(ready);
  EXPECT_THAT(see(error), ElementsAre(ProgramEventKind::aborted));
  EXPECT_EQ(last.started, Time{});
  EXPECT_EQ(last.program, "demo.nc");
}

TEST_F(AProgramWatch, HasNoStartOfAProgramWhoseRunItDidNotSeeAfterAFailedOne) {
  see(ready);
  see(active);
  see(error);
  see(ready);
  EXPECT_THAT(see(error), ElementsAre(ProgramEventKind::aborted));
  EXPECT_EQ(last.started, Time{});
}

TEST_F(AProgramWatch, ReportsAHaltAndItsContinuation) {
  see(ready);
  see(active);
  EXPECT_THAT(see(hold), ElementsAre(ProgramEventKind::on_hold));
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::resumed));
  EXPECT_THAT(see(ready), ElementsAre(ProgramEventKind::ended));
  EXPECT_EQ(last.at - last.started, 3s);
}

TEST_F(AProgramWatch, ReportsBothWhenAProgramHaltsAtOnce) {
  see(ready);
  EXPECT_THAT(see(hold), ElementsAre(ProgramEventKind::started, ProgramEventKind::on_hold));
}

TEST_F(AProgramWatch, ReportsARemovedProgramAsReset) {
  see(ready);
  see(active);
  EXPECT_THAT(see(selected, standby), ElementsAre(ProgramEventKind::reset));
  see(ready);
  see(active);
  see(hold);
  EXPECT_THAT(see(selected), ElementsAre(ProgramEventKind::reset));
  see(ready);
  see(active);
  EXPECT_THAT(see(0), ElementsAre(ProgramEventKind::reset));
}

TEST_F(AProgramWatch, ReportsWhatRunsWhenItBegins) {
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::started));
  EXPECT_EQ(last.started, Time{});
  EXPECT_EQ(last.program, "demo.nc");
  EXPECT_EQ(last.detail, "running when the gateway began to watch");
  EXPECT_THAT(see(ready), ElementsAre(ProgramEventKind::ended));
  EXPECT_EQ(last.started, Time{});
  EXPECT_EQ(last.program, "demo.nc");
  EXPECT_EQ(last.detail, "");
}

TEST_F(AProgramWatch, ReportsWhatIsHeldWhenItBegins) {
  EXPECT_THAT(see(hold), ElementsAre(ProgramEventKind::started, ProgramEventKind::on_hold));
}

TEST_F(AProgramWatch, ReportsAnErrorThatIsThereWhenItBegins) {
  lose_link();
  EXPECT_THAT(see(error), ElementsAre(ProgramEventKind::aborted));
  EXPECT_EQ(last.error, 21462U);
  EXPECT_EQ(last.detail, "running when the gateway began to watch");
}

TEST_F(AProgramWatch, MarksWhatItFoundWhenTheLinkWasBack) {
  see(ready);
  see(active);
  EXPECT_THAT(lose_link(), IsEmpty());
  EXPECT_THAT(see(active), IsEmpty());
  lose_link();
  EXPECT_THAT(see(ready), ElementsAre(ProgramEventKind::ended));
  EXPECT_EQ(last.detail, "seen when the connection was restored");
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::started));
  EXPECT_EQ(last.detail, "");
}

TEST_F(AProgramWatch, IgnoresAnUndefinedState) {
  see(ready);
  EXPECT_THAT(see(99), IsEmpty());
  EXPECT_THAT(see(-1), IsEmpty());
  EXPECT_THAT(see(active), ElementsAre(ProgramEventKind::started));
}

TEST_F(AProgramWatch, ReadsWhatItNeedsOnce) {
  const auto group = group_of({.channel = 2, .period = 50ms, .name = "A", .counter = "A"});
  EXPECT_EQ(group.channel, 2);
  EXPECT_EQ(group.period, 50ms);
  EXPECT_THAT(group.names, ElementsAre("state", "mode", "A"));
}

}  // namespace
}  // namespace millrace::gateway::programs
