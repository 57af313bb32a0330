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

Rule lasting_rule(Rule::Kind kind) {
  Rule rule;
  rule.name = "lasting";
  rule.kind = kind;
  rule.after = 30s;
  rule.quiet = 600s;
  rule.uuid = kind == Rule::Kind::no_instance ? uuid : "";
  return rule;
}

fabric::InstanceId id_of(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

class ARule : public testing::Test {
 protected:
  void begin(const Rule& rule) { sut.emplace(std::vector<Rule>{rule}, now); }

  void pass(std::chrono::seconds time) {
    now.steady += time;
    now.wall += time;
    sut->on_time(now);
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
  std::vector<RuleEvent> channel(ChannelState state, std::chrono::seconds ago = 0s) {
    return see(fabric::ChannelStatus{.key = {"press", 1},
                                     .state = state,
                                     .since = now.wall - ago,
                                     .uuid = uuid,
                                     .reason = "all instances are busy"});
  }
  std::vector<RuleEvent> link(std::uint8_t gateway, bool connected) {
    return see(fabric::MachineStatus{.machine = "press",
                                     .gateway = id_of(gateway),
                                     .connected = connected,
                                     .since = now.wall,
                                     .reason = connected ? "" : "no route"});
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

TEST_F(ARule, OfWaitingChannelsHasOneOccasionForEachWait) {
  begin(lasting_rule(Rule::Kind::waits));
  EXPECT_THAT(channel(ChannelState::waiting), IsEmpty());
  pass(29s);
  EXPECT_THAT(sut->take(), IsEmpty());
  pass(1s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("state"), "waiting");
  EXPECT_EQ(occasions[0].values.at("reason"), "all instances are busy");
  EXPECT_EQ(occasions[0].values.at("seconds"), "30.0");
  pass(3600s);
  EXPECT_THAT(sut->take(), IsEmpty());
}

TEST_F(ARule, OfWaitingChannelsForgetsAWaitThatIsOver) {
  begin(lasting_rule(Rule::Kind::waits));
  channel(ChannelState::waiting);
  pass(29s);
  channel(ChannelState::running);
  pass(60s);
  EXPECT_THAT(sut->take(), IsEmpty());
  EXPECT_FALSE(sut->next_time());
}

TEST_F(ARule, CountsTheWaitFromItsBeginning) {
  begin(lasting_rule(Rule::Kind::waits));
  EXPECT_THAT(channel(ChannelState::held, 40s), SizeIs(1));
}

TEST_F(ARule, OfLinksWaitsForTheLastGatewayToLoseIt) {
  begin(lasting_rule(Rule::Kind::link_down));
  link(1, true);
  link(2, false);
  pass(100s);
  EXPECT_THAT(sut->take(), IsEmpty());
  link(1, false);
  pass(30s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("machine"), "press");
  EXPECT_EQ(occasions[0].values.at("reason"), "no route");
}

TEST_F(ARule, OfLinksReportsAfterTheQuietTimeWhatLastsThen) {
  begin(lasting_rule(Rule::Kind::link_down));
  link(1, false);
  pass(30s);
  EXPECT_THAT(sut->take(), SizeIs(1));
  link(1, true);
  pass(10s);
  link(1, false);
  pass(300s);
  EXPECT_THAT(sut->take(), IsEmpty());
  pass(300s);
  EXPECT_THAT(sut->take(), SizeIs(1));
}

TEST_F(ARule, OfServicesHasAnOccasionWhenNoInstanceIsReady) {
  begin(lasting_rule(Rule::Kind::no_instance));
  instance(1, fabric::observer::Change::ready);
  instance(2, fabric::observer::Change::ready);
  pass(60s);
  instance(1, fabric::observer::Change::gone);
  pass(60s);
  EXPECT_THAT(sut->take(), IsEmpty());
  instance(2, fabric::observer::Change::gone);
  pass(30s);
  const auto occasions = sut->take();
  ASSERT_THAT(occasions, SizeIs(1));
  EXPECT_EQ(occasions[0].values.at("uuid"), uuid);
}

TEST_F(ARule, OfServicesHasAnOccasionWhenNoneEverComes) {
  begin(lasting_rule(Rule::Kind::no_instance));
  pass(30s);
  EXPECT_THAT(sut->take(), SizeIs(1));
}

TEST_F(ARule, IsBoundedAndReportsThatOnce) {
  begin(lasting_rule(Rule::Kind::waits));
  for (std::uint16_t i = 0; i < 10'100; ++i) {
    see(fabric::ChannelStatus{.key = {"m", i}, .state = ChannelState::waiting, .since = now.wall});
  }
  EXPECT_THAT(sut->take_lines(), ElementsAre(HasSubstr("more than 10000 channels")));
  pass(30s);
  EXPECT_THAT(sut->take(), SizeIs(10'000));
}

}  // namespace
}  // namespace millrace::services::mail
