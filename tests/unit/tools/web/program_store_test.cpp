#include "tools/web/plant/program_store.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::web::plant {
namespace {

using fabric::ProgramEvent;
using fabric::ProgramEventKind;
using recording::tests::at;
using testing::ElementsAre;
using testing::SizeIs;

class AProgramStore : public testing::Test {
 protected:
  void tell(ProgramEventKind kind, double ms, double started, std::uint16_t channel = 1) {
    sut.add({.key = {"press", channel},
             .kind = kind,
             .at = at(ms),
             .started = at(started),
             .program = "good.nc",
             .error = kind == ProgramEventKind::aborted ? 21462U : 0U},
            at(ms));
  }
  [[nodiscard]] std::vector<std::string> states(const ProgramFilter& filter = {}) const {
    std::vector<std::string> out;
    const boost::json::object found = sut.runs(filter, 100);
    for (const auto& run : found.at("runs").as_array()) {
      out.emplace_back(run.at("state").as_string());
    }
    return out;
  }

  ProgramStore sut;
};

TEST_F(AProgramStore, PutsTheEventsOfARunTogether) {
  tell(ProgramEventKind::started, 0, 0);
  EXPECT_THAT(states(), ElementsAre("running"));
  tell(ProgramEventKind::on_hold, 1000, 0);
  EXPECT_THAT(states(), ElementsAre("on hold"));
  tell(ProgramEventKind::resumed, 1500, 0);
  EXPECT_THAT(states(), ElementsAre("running"));
  tell(ProgramEventKind::ended, 2000, 0);
  EXPECT_THAT(states(), ElementsAre("ended"));
  const auto run = sut.runs({}, 1).at("runs").at(0);
  EXPECT_EQ(run.at("duration_s"), 2.0);
  EXPECT_EQ(run.at("program"), "good.nc");
  ASSERT_THAT(run.at("holds").as_array(), SizeIs(1));
  EXPECT_TRUE(run.at("holds").at(0).as_object().contains("to"));
}

TEST_F(AProgramStore, HasTheNewestRunFirst) {
  tell(ProgramEventKind::started, 0, 0);
  tell(ProgramEventKind::ended, 100, 0);
  tell(ProgramEventKind::started, 50, 50, 2);
  tell(ProgramEventKind::started, 200, 200);
  tell(ProgramEventKind::aborted, 300, 200);
  EXPECT_THAT(states(), ElementsAre("aborted", "running", "ended"));
  EXPECT_THAT(states({.channel = 2}), ElementsAre("running"));
  EXPECT_EQ(sut.runs({}, 1).at("more"), true);
  EXPECT_EQ(sut.runs({}, 1).at("runs").at(0).at("error"), 21462);
}

TEST_F(AProgramStore, HasARunWithoutItsStart) {
  sut.add({.key = {"press", 1}, .kind = ProgramEventKind::ended, .at = at(100)}, at(100));
  EXPECT_THAT(states(), ElementsAre("ended"));
  EXPECT_FALSE(sut.runs({}, 1).at("runs").at(0).as_object().contains("duration_s"));
}

TEST_F(AProgramStore, CountsARepeatedEventOnce) {
  tell(ProgramEventKind::started, 0, 0);
  tell(ProgramEventKind::ended, 100, 0);
  tell(ProgramEventKind::ended, 100, 0);
  EXPECT_THAT(states(), ElementsAre("ended"));
}

TEST_F(AProgramStore, ShowsARunWithoutAnEndAsUnknown) {
  tell(ProgramEventKind::started, 0, 0);
  sut.silence("press");
  EXPECT_THAT(states(), ElementsAre("unknown"));
  tell(ProgramEventKind::started, 500, 500);
  EXPECT_THAT(states(), ElementsAre("running", "unknown"));
  tell(ProgramEventKind::started, 900, 900);
  EXPECT_THAT(states(), ElementsAre("running", "unknown", "unknown"));
}

TEST_F(AProgramStore, ShowsARunAgainWhenItsGatewayReturns) {
  tell(ProgramEventKind::started, 0, 0);
  tell(ProgramEventKind::started, 100, 100);
  sut.silence("press");
  sut.end_silence("other");
  EXPECT_THAT(states(), ElementsAre("unknown", "unknown"));
  sut.end_silence("press");
  EXPECT_THAT(states(), ElementsAre("running", "unknown"));
}

TEST_F(AProgramStore, HasOneRunForAnErrorThatTheNextGatewayFinds) {
  tell(ProgramEventKind::started, 0, 0);
  tell(ProgramEventKind::aborted, 100, 0);
  sut.add({.key = {"press", 1}, .kind = ProgramEventKind::aborted, .at = at(900)}, at(900));
  EXPECT_THAT(states(), ElementsAre("aborted"));
  tell(ProgramEventKind::reset, 1000, 0);
  EXPECT_THAT(states(), ElementsAre("aborted"));
}

TEST_F(AProgramStore, HasTheFieldsOfTheCommandForTheLastEventOfEachChannel) {
  tell(ProgramEventKind::started, 0, 0);
  tell(ProgramEventKind::aborted, 1500, 0);
  tell(ProgramEventKind::started, 0, 0, 2);
  const auto last = sut.last({.machine = "press", .channel = 1});
  ASSERT_THAT(last, SizeIs(1));
  EXPECT_EQ(last.at(0).at("kind"), "program");
  EXPECT_EQ(last.at(0).at("event"), "aborted");
  EXPECT_EQ(last.at(0).at("error"), 21462);
  EXPECT_EQ(last.at(0).at("duration_s"), 1.5);
  EXPECT_THAT(sut.last({}), SizeIs(2));
}

TEST_F(AProgramStore, KeepsNoMoreThanItHasRoomFor) {
  sut = ProgramStore({.channels = 2, .runs = 3, .holds = 2});
  for (int i = 0; i < 10; ++i) {
    tell(ProgramEventKind::started, i * 100, i * 100);
    for (int hold = 0; hold < 5; ++hold) {
      tell(ProgramEventKind::on_hold, i * 100 + hold, i * 100);
      tell(ProgramEventKind::resumed, i * 100 + hold, i * 100);
    }
  }
  EXPECT_THAT(states(), SizeIs(3));
  EXPECT_THAT(sut.runs({}, 1).at("runs").at(0).at("holds").as_array(), SizeIs(2));
  tell(ProgramEventKind::started, 2000, 2000, 2);
  tell(ProgramEventKind::started, 3000, 3000, 3);
  EXPECT_EQ(sut.channels(), 2U);
  EXPECT_THAT(sut.last({.channel = 1}), testing::IsEmpty());
}

}  // namespace
}  // namespace millrace::tools::web::plant
