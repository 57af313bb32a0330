#include "services/mail/rule_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::mail {
namespace {

using namespace std::chrono_literals;
using fabric::ChannelState;
using fabric::Moment;
using fabric::ProgramEventKind;
using fabric::SteadyTime;
using fabric::Time;
using fabric::plant::Kind;
using fabric::plant::Level;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

Rule program_rule() {
  Rule rule;
  rule.name = "programs";
  rule.kind = Rule::Kind::program;
  rule.events = {ProgramEventKind::ended, ProgramEventKind::aborted};
  rule.quiet = 60s;
  return rule;
}

Rule concern_rule(Level least = Level::act) {
  Rule rule;
  rule.name = "concerns";
  rule.kind = Rule::Kind::concern;
  rule.least = least;
  rule.after = 30s;
  rule.quiet = 600s;
  return rule;
}

Rule instance_rule() {
  Rule rule = concern_rule();
  rule.kind = Rule::Kind::no_instance;
  rule.uuid = uuid;
  return rule;
}

fabric::InstanceId id_of(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

class ARule : public testing::Test {
 protected:
  void begin(const Rule& rule) { sut.emplace(std::vector<Rule>{rule}, " --domain 7", now); }

  void pass(std::chrono::seconds time) {
    for (; time > 0s; time -= 1s) {
      now.steady += 1s;
      now.wall += 1s;
      sut->on_time(now);
    }
  }
  std::vector<RuleEvent> see(fabric::observer::Sample sample) {
    sut->on_entry({.at = now.wall, .sample = std::move(sample)}, now);
    return sut->take();
  }
  std::vector<RuleEvent> event(ProgramEventKind kind, const std::string& machine = "press") {
    return see(fabric::ProgramEvent{.key = {machine, 1},
                                    .kind = kind,
                                    .at = now.wall,
                                    .started = now.wall - 90s,
                                    .program = "wei\xDF.nc",
                                    .error = kind == ProgramEventKind::aborted ? 21462U : 0U,
                                    .parts = 12});
  }
  void channel(ChannelState state, std::uint16_t number = 1, std::chrono::seconds ago = 0s) {
    see(fabric::ChannelStatus{.key = {"press", number},
                              .state = state,
                              .since = now.wall - ago,
                              .call = {1, number},
                              .uuid = uuid,
                              .reason = "all instances are busy"});
  }
  void link(const std::string& machine, bool connected, std::uint8_t gateway = 1) {
    see(fabric::MachineStatus{.machine = machine,
                              .gateway = id_of(gateway),
                              .connected = connected,
                              .since = now.wall,
                              .reason = connected ? "" : "no route",
                              .host = "vm"});
  }
  std::vector<RuleEvent> instance(std::uint8_t id, fabric::observer::Change change) {
    return see(fabric::observer::InstanceNews{change, {.id = id_of(id), .uuid = uuid}});
  }

  Moment now{SteadyTime(1000s), Time(1'772'348'400s)};
  std::optional<RuleWatch> sut;
};

TEST_F(ARule, OfProgramsHasAnOccasionForEachEventThatItNames) {
  begin(program_rule());
  EXPECT_THAT(event(ProgramEventKind::started), IsEmpty());
  const auto occasions = event(ProgramEventKind::aborted);
  ASSERT_THAT(occasions, SizeIs(1));
  const Values& values = occasions[0].values;
  EXPECT_EQ(values.at("machine"), "press");
  EXPECT_EQ(values.at("channel"), "1");
  EXPECT_EQ(values.at("program"), "wei\xC3\x9F.nc");
  EXPECT_EQ(values.at("event"), "aborted");
  EXPECT_EQ(values.at("error"), "21462");
  EXPECT_EQ(values.at("parts"), "12");
  EXPECT_EQ(values.at("duration"), "90.0");
  EXPECT_EQ(values.at("time"), "2026-03-01 07:00:00 UTC");
  EXPECT_EQ(values.at("uuid"), "");
}

TEST_F(ARule, IsQuietForAWhileAndCountsWhatItSkipped) {
  begin(program_rule());
  EXPECT_THAT(event(ProgramEventKind::ended), SizeIs(1));
  pass(20s);
  EXPECT_THAT(event(ProgramEventKind::ended), IsEmpty());
  EXPECT_THAT(sut->take_lines(), ElementsAre(HasSubstr("rule programs: no mail about press/1")));
  EXPECT_THAT(event(ProgramEventKind::ended, "lathe"), SizeIs(1));
  pass(41s);
  const auto next = event(ProgramEventKind::ended);
  ASSERT_THAT(next, SizeIs(1));
  EXPECT_EQ(next[0].values.at("unsaid"), "1");
}

TEST_F(ARule, GivesTheSameOccasionTheSameIdEverywhere) {
  begin(program_rule());
  const auto first = event(ProgramEventKind::ended);
  begin(program_rule());
  EXPECT_EQ(event(ProgramEventKind::ended).at(0).id, first.at(0).id);
  begin(program_rule());
  EXPECT_NE(event(ProgramEventKind::ended, "lathe").at(0).id, first.at(0).id);
}

TEST_F(ARule, IsForTheMachinesItNames) {
  Rule rule = program_rule();
  rule.machines = {"lathe"};
  begin(rule);
  EXPECT_THAT(event(ProgramEventKind::ended), IsEmpty());
  EXPECT_THAT(event(ProgramEventKind::ended, "lathe"), SizeIs(1));
}

TEST_F(ARule, IgnoresOldAndReplayedSamples) {
  begin(program_rule());
  EXPECT_THAT(see(fabric::ProgramEvent{
                  .key = {"press", 1}, .kind = ProgramEventKind::ended, .at = now.wall - 11min}),
              IsEmpty());
  EXPECT_THAT(
      see(fabric::ProgramEvent{
          .key = {"press", 1}, .kind = ProgramEventKind::ended, .at = now.wall, .replayed = true}),
      IsEmpty());
}

TEST_F(ARule, OfConcernsHasOneOccasionForACauseThatLasts) {
  begin(concern_rule());
  link("press", true);
  channel(ChannelState::held);
  pass(29s);
  EXPECT_THAT(sut->take(), IsEmpty());
  pass(1s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  const Values& values = occasions[0].values;
  EXPECT_EQ(values.at("subject"), "press/1");
  EXPECT_EQ(values.at("kind"), "held");
  EXPECT_EQ(values.at("level"), "act");
  EXPECT_EQ(values.at("who"), "operator");
  EXPECT_EQ(values.at("machine"), "press");
  EXPECT_EQ(values.at("channel"), "1");
  EXPECT_EQ(values.at("reason"), "all instances are busy");
  EXPECT_THAT(values.at("todo"), HasSubstr("`millrace retry press/1 --domain 7`"));
  EXPECT_EQ(values.at("since"), "2026-03-01 07:00:00 UTC");
  EXPECT_EQ(values.at("seconds"), "30.0");
  pass(3600s);
  EXPECT_THAT(sut->take(), IsEmpty());
}

TEST_F(ARule, OfConcernsForgetsACauseThatIsOver) {
  begin(concern_rule());
  link("press", true);
  channel(ChannelState::held);
  pass(29s);
  channel(ChannelState::running);
  pass(20s);
  channel(ChannelState::held);
  pass(29s);
  EXPECT_THAT(sut->take(), IsEmpty());
}

TEST_F(ARule, CountsTheTimeFromTheBeginningOfTheCause) {
  begin(concern_rule());
  link("press", true);
  channel(ChannelState::held, 1, 40s);
  pass(5s);
  EXPECT_THAT(sut->take(), SizeIs(1));
}

TEST_F(ARule, JudgesNothingBeforeItHasSeenTheFabric) {
  Rule rule = concern_rule();
  rule.after = 0s;
  begin(rule);
  pass(4s);
  link("press", true);
  EXPECT_THAT(sut->take(), IsEmpty()) << "there seemed to be no gateway";
  pass(60s);
  EXPECT_THAT(sut->take(), IsEmpty());
}

TEST_F(ARule, OfALostGatewayHasOneOccasionForAllOfItsMachines) {
  begin(concern_rule());
  link("press", true);
  link("mill", true);
  for (const char* machine : {"press", "mill"}) {
    see(fabric::MachineStatus{
        .machine = machine, .gateway = id_of(1), .since = now.wall, .gone = true});
  }
  pass(30s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("kind"), "gateway gone");
  EXPECT_EQ(occasions[0].values.at("machine"), "mill, press");
  EXPECT_EQ(occasions[0].values.at("channel"), "");
}

TEST_F(ARule, OfALinkWaitsForTheLastGatewayToLoseIt) {
  begin(concern_rule());
  link("press", true);
  link("press", false, 2);
  pass(100s);
  EXPECT_THAT(sut->take(), IsEmpty());
  link("press", false);
  pass(30s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("kind"), "link down");
}

TEST_F(ARule, ReportsAfterTheQuietTimeWhatLastsThen) {
  begin(concern_rule());
  link("press", false);
  pass(30s);
  EXPECT_THAT(sut->take(), SizeIs(1));
  link("press", true);
  pass(10s);
  link("press", false);
  pass(300s);
  EXPECT_THAT(sut->take(), IsEmpty());
  pass(300s);
  EXPECT_THAT(sut->take(), SizeIs(1));
}

TEST_F(ARule, SelectsTheLevel) {
  const auto run = [&](Level least) {
    begin(concern_rule(least));
    link("press", true);
    see(fabric::observer::AlarmNews{.alarm = {.key = {id_of(7), "archive", ""},
                                              .level = fabric::AlarmLevel::warning,
                                              .text = "the disk is nearly full",
                                              .since = now.wall}});
    pass(60s);
    return sut->take();
  };
  EXPECT_THAT(run(Level::act), IsEmpty());
  const auto occasions = run(Level::look);
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("todo"), "see `millrace status --domain 7`")
      << "it has no advice";
}

TEST_F(ARule, SelectsKindsAndMachines) {
  Rule rule = concern_rule();
  rule.kinds = {Kind::link_down};
  rule.machines = {"mill"};
  begin(rule);
  link("press", true);
  channel(ChannelState::held);
  link("mill", false);
  link("lathe", false);
  pass(60s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("subject"), "mill");
}

TEST_F(ARule, OfAServiceHasAnOccasionWhenNoInstanceTakesCalls) {
  begin(instance_rule());
  instance(1, fabric::observer::Change::ready);
  instance(2, fabric::observer::Change::ready);
  pass(60s);
  instance(1, fabric::observer::Change::gone);
  pass(60s);
  EXPECT_THAT(sut->take(), IsEmpty());
  instance(2, fabric::observer::Change::gone);
  pass(31s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("uuid"), uuid);
}

TEST_F(ARule, OfAServiceHasAnOccasionWhenNoInstanceEverComes) {
  begin(instance_rule());
  pass(36s);
  EXPECT_THAT(sut->take(), SizeIs(1));
}

TEST_F(ARule, OfProgramsNeedsNoTime) {
  begin(program_rule());
  EXPECT_FALSE(sut->next_time());
  begin(concern_rule());
  EXPECT_EQ(sut->next_time(), now.steady + RuleWatch::settle);
}

TEST_F(ARule, IsBoundedAndReportsThatOnce) {
  begin(concern_rule());
  link("press", true);
  for (std::uint16_t i = 1; i <= 10'100; ++i) {
    channel(ChannelState::held, i, 60s);
  }
  pass(5s);
  EXPECT_THAT(sut->take(), SizeIs(10'000));
  EXPECT_THAT(sut->take_lines(), ElementsAre(HasSubstr("more than 10000 channels")));
  pass(10s);
  EXPECT_THAT(sut->take_lines(), IsEmpty());
}

}  // namespace
}  // namespace millrace::services::mail
