#include "fabric/plant/plant.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/fabric/plant/samples.hpp"

namespace millrace::fabric::plant {
namespace {

using namespace std::chrono_literals;
using observer::Change;
using observer::Entry;
using observer::InstanceNews;
using testing::IsEmpty;
using namespace samples;
using testing::SizeIs;

Entry news(Change change, std::uint8_t byte, const std::string& name) {
  InstanceNews what{.change = change, .identity = {.id = id(byte)}};
  what.identity.uuid = square_root;
  what.identity.name = name;
  return {.sample = what};
}

Entry load(std::uint8_t byte, std::uint64_t answered) {
  return {.sample = InstanceStatus{.instance = id(byte), .answered = answered}};
}

TEST(APlant, HasAnInstanceUntilItIsGone) {
  Plant sut;
  sut.add(news(Change::ready, 1, "a"));
  sut.add(news(Change::changed, 1, "b"));
  EXPECT_EQ(sut.instances().at(id(1)).identity.name, "b");
  EXPECT_EQ(sut.instances().at(id(1)).status, std::nullopt);
  sut.add(news(Change::gone, 1, ""));
  EXPECT_THAT(sut.instances(), IsEmpty());
}

TEST(APlant, HasInstancesThatAreGoneUntilTheyAreForgotten) {
  Plant sut;
  sut.add(news(Change::ready, 1, "a"));
  Entry gone = news(Change::gone, 1, "");
  gone.at = Time(std::chrono::seconds(100));
  sut.add(gone);
  ASSERT_THAT(sut.gone(), SizeIs(1));
  EXPECT_EQ(sut.gone().at(id(1)).last.identity.name, "a");
  sut.forget_gone(gone.at);
  EXPECT_THAT(sut.gone(), SizeIs(1));
  sut.forget_gone(gone.at + std::chrono::seconds(1));
  EXPECT_THAT(sut.gone(), IsEmpty());
  // The gone instance was unknown before.
  sut.add(news(Change::gone, 2, ""));
  EXPECT_THAT(sut.gone(), IsEmpty());
  sut.add(gone);
  sut.add(news(Change::ready, 1, "a"));
  EXPECT_THAT(sut.gone(), IsEmpty());
}

TEST(APlant, HasASilentInstanceUntilItsProcessIsGone) {
  Plant sut;
  sut.add(news(Change::ready, 1, "a"));
  Entry silent = news(Change::silent, 1, "");
  silent.at = Time(std::chrono::seconds(100));
  sut.add(silent);
  sut.forget_gone(silent.at + std::chrono::hours(1));
  EXPECT_THAT(sut.gone(), SizeIs(1));
  sut.add(news(Change::gone, 1, ""));
  sut.forget_gone(silent.at + std::chrono::hours(1));
  EXPECT_THAT(sut.gone(), IsEmpty());
}

TEST(APlant, HasTheProcessOfTheGatewayOfALostMachine) {
  Plant sut;
  const auto machine = [&](std::uint8_t gateway, const std::string& host) {
    sut.add({.sample = MachineStatus{.machine = "cnc",
                                     .gateway = id(gateway),
                                     .since = Time(std::chrono::seconds(7)),
                                     .host = host,
                                     .pid = host.empty() ? 0U : 4711U,
                                     .gone = host.empty()}});
  };
  machine(1, "hall");
  EXPECT_THAT(sut.lost(), IsEmpty());
  machine(1, "");
  ASSERT_THAT(sut.lost(), SizeIs(1));
  EXPECT_EQ(sut.lost()[0].last.host, "hall");
  EXPECT_EQ(sut.lost()[0].last.pid, 4711U);
  EXPECT_EQ(sut.lost()[0].since, Time(std::chrono::seconds(7)));
  machine(2, "hall");
  EXPECT_THAT(sut.lost(), IsEmpty());
  machine(2, "");
  ASSERT_THAT(sut.lost(), SizeIs(1));
  EXPECT_EQ(sut.lost()[0].last.gateway, id(2)) << "the last one";
}

TEST(APlant, LosesTheMachinesOfOneOfTwoGatewaysOfAHost) {
  Plant sut;
  const auto machine = [&](const std::string& name, std::uint8_t gateway, bool gone) {
    sut.add({.sample = MachineStatus{.machine = name,
                                     .gateway = id(gateway),
                                     .host = gone ? "" : "hall",
                                     .pid = gone ? 0U : 4710U + gateway,
                                     .gone = gone}});
  };
  machine("cnc", 1, false);
  machine("lathe", 2, false);
  // The second stands by for the first.
  machine("cnc", 2, false);
  machine("lathe", 2, true);
  machine("cnc", 2, true);
  ASSERT_THAT(sut.lost(), SizeIs(1));
  EXPECT_EQ(sut.lost()[0].last.machine, "lathe");
  EXPECT_EQ(sut.lost()[0].last.pid, 4712U);
  EXPECT_FALSE(sut.machines().at({"cnc", id(1)}).gone);
}

TEST(APlant, KeepsTheStatusOfAnInstanceBeforeItsDiscovery) {
  Plant sut;
  sut.add(load(1, 5));
  EXPECT_THAT(sut.instances(), IsEmpty());
  sut.add(news(Change::ready, 1, "a"));
  EXPECT_EQ(sut.instances().at(id(1)).status->answered, 5U);
  sut.add(load(1, 6));
  EXPECT_EQ(sut.instances().at(id(1)).status->answered, 6U);
}

TEST(APlant, FindsInstancesByUuidIdOrName) {
  Plant sut;
  sut.add(news(Change::ready, 1, "a"));
  sut.add(news(Change::ready, 2, "b"));
  EXPECT_THAT(sut.instances_of("560AACBF-6335-44A9-895A-8B27F3ED5E47"), SizeIs(2));
  EXPECT_THAT(sut.instances_of(id(2).to_string()), SizeIs(1));
  EXPECT_THAT(sut.instances_of("a"), SizeIs(1));
  EXPECT_THAT(sut.instances_of("A"), SizeIs(1));
  EXPECT_THAT(sut.instances_of("aa"), IsEmpty());
  EXPECT_THAT(sut.instances_of(""), SizeIs(2));
}

TEST(APlant, HasTheNewestOfChannelsAndMachines) {
  Plant sut;
  for (const auto state : {ChannelState::running, ChannelState::idle}) {
    sut.add({.sample = ChannelStatus{.key = {"cnc", 1}, .state = state}});
  }
  for (const bool connected : {false, true}) {
    sut.add({.sample = MachineStatus{.machine = "cnc", .connected = connected}});
  }
  EXPECT_EQ(sut.channels().at({"cnc", 1}).state, ChannelState::idle);
  EXPECT_TRUE(sut.machines().at({"cnc", {}}).connected);
}

TEST(APlant, ReportsWhetherAProcessIsNew) {
  Plant sut;
  EXPECT_TRUE(sut.add(news(Change::ready, 1, "a")));
  EXPECT_FALSE(sut.add(news(Change::ready, 1, "a")));
  EXPECT_TRUE(sut.add(news(Change::gone, 1, "a")));
  EXPECT_FALSE(sut.add(news(Change::gone, 1, "a")));
  const observer::Entry channel{.sample = ChannelStatus{.key = {"cnc", 1}}};
  EXPECT_TRUE(sut.add(channel));
  EXPECT_FALSE(sut.add(channel));
  const observer::Entry machine{.sample = MachineStatus{.machine = "cnc"}};
  EXPECT_TRUE(sut.add(machine));
  EXPECT_FALSE(sut.add(machine));
  EXPECT_FALSE(sut.add({.sample = InstanceStatus{.instance = id(1)}}));
}

TEST(APlant, KeepsApartTwoGatewaysOfOneMachine) {
  Plant sut;
  const InstanceId first = id(1), second = id(2);
  sut.add({.sample = MachineStatus{.machine = "cnc", .gateway = first, .connected = true}});
  sut.add({.sample = MachineStatus{.machine = "cnc", .gateway = second}});
  EXPECT_TRUE(sut.machines().at({"cnc", first}).connected);
  EXPECT_FALSE(sut.machines().at({"cnc", second}).connected);
}

observer::Entry removed(const std::string& name, std::uint8_t gateway = 99) {
  return entry(MachineStatus{.machine = name,
                             .gateway = id(gateway),
                             .reason = base::messages::machine_removed(),
                             .gone = true});
}

TEST(APlant, ForgetsAMachineThatWasRemovedFromTheConfiguration) {
  Plant sut;
  sut.add(machine("press", true));
  sut.add(machine("mill", true));
  sut.add(channel(1, ChannelState::running, square_root));
  sut.add(program(1, ProgramEventKind::started));
  sut.add(removed("press"));
  EXPECT_THAT(sut.lost(), IsEmpty());
  EXPECT_THAT(sut.channels(), IsEmpty());
  EXPECT_EQ(sut.program_of({"press", 1}), nullptr);
  EXPECT_EQ(sut.machines().size(), 1U);
}

TEST(APlant, KeepsAMachineThatAnotherGatewayServes) {
  Plant sut;
  sut.add(machine("press", true));
  sut.add(entry(MachineStatus{.machine = "press", .gateway = id(5), .connected = true}));
  sut.add(channel(1, ChannelState::running, square_root));
  sut.add(removed("press"));
  EXPECT_TRUE(sut.has_gateway("press"));
  EXPECT_EQ(sut.channels().size(), 1U);
}

observer::Entry gone_because(const std::string& name, Message reason) {
  return entry(
      MachineStatus{.machine = name, .gateway = id(99), .reason = std::move(reason), .gone = true});
}

TEST(APlant, ForgetsAMachineOnRequestUntilAGatewayReportsItAgain) {
  Plant sut;
  sut.add(machine("press", true));
  sut.add(machine("mill", true));
  sut.add(channel(1, ChannelState::running, square_root));
  sut.add(program(1, ProgramEventKind::started));
  EXPECT_FALSE(sut.forget_machine("press")) << "its gateway is there";
  EXPECT_FALSE(sut.forget_machine("drill")) << "it is unknown";
  sut.add(gone_because("press", base::messages::gateway_not_responding()));
  EXPECT_TRUE(sut.forget_machine("press"));
  EXPECT_THAT(sut.lost(), IsEmpty());
  EXPECT_THAT(sut.channels(), IsEmpty());
  EXPECT_EQ(sut.machines().size(), 1U);
  // The gateway, which was silent, ends.
  sut.add(gone_because("press", base::messages::gateway_gone()));
  sut.add(entry(ChannelStatus{.key = {"press", 1}, .gone = true}));
  EXPECT_THAT(sut.lost(), IsEmpty());
  EXPECT_THAT(sut.channels(), IsEmpty());
  sut.add(machine("press", true));
  sut.add(channel(1, ChannelState::idle, square_root));
  EXPECT_TRUE(sut.has_gateway("press"));
  EXPECT_EQ(sut.channels().size(), 1U);
  sut.add(gone_because("press", base::messages::gateway_gone()));
  EXPECT_THAT(sut.lost(), SizeIs(1)) << "that is news again";
}

observer::Entry news_of(const Alarm& alarm, bool over = false) {
  return entry(observer::AlarmNews{.over = over, .alarm = alarm});
}

TEST(APlant, HasAnAlarmUntilItIsOver) {
  Plant sut;
  Alarm alarm{.key = {id(1), "archive", ""}, .text = "disk full"};
  EXPECT_TRUE(sut.add(news_of(alarm)));
  alarm.text = "disk gone";
  EXPECT_FALSE(sut.add(news_of(alarm)));
  EXPECT_EQ(sut.alarms().at(alarm.key), alarm);
  sut.add(news_of(alarm, true));
  EXPECT_THAT(sut.alarms(), IsEmpty());
}

TEST(APlant, KeepsALimitedNumberOfAlarms) {
  Plant sut;
  for (std::size_t i = 0; i < Plant::most_alarms; ++i) {
    sut.add(news_of({.key = {id(1), "flood", std::to_string(i)}}));
  }
  EXPECT_FALSE(sut.too_many_alarms());
  EXPECT_FALSE(sut.add(news_of({.key = {id(1), "flood", "one more"}})));
  EXPECT_TRUE(sut.too_many_alarms());
  EXPECT_THAT(sut.alarms(), SizeIs(Plant::most_alarms));
}

const ChannelKey press_1{"press", 1};

TEST(APlant, HasTheProgramOfAChannelUntilItEndsOrItsErrorIsCleared) {
  Plant sut;
  sut.add(machine("press", true));
  EXPECT_EQ(sut.program_of(press_1), nullptr);
  EXPECT_TRUE(sut.add(program(1, ProgramEventKind::started)));
  ASSERT_NE(sut.program_of(press_1), nullptr);
  EXPECT_EQ(sut.program_of(press_1)->state, Program::State::running);
  EXPECT_FALSE(sut.add(program(1, ProgramEventKind::on_hold)));
  EXPECT_EQ(sut.program_of(press_1)->state, Program::State::on_hold);
  sut.add(program(1, ProgramEventKind::resumed));
  EXPECT_EQ(sut.program_of(press_1)->state, Program::State::running);
  sut.add(program(1, ProgramEventKind::aborted));
  EXPECT_EQ(sut.program_of(press_1)->state, Program::State::aborted);
  EXPECT_TRUE(sut.add(program(1, ProgramEventKind::reset)));
  EXPECT_EQ(sut.program_of(press_1), nullptr);
  sut.add(program(1, ProgramEventKind::started));
  sut.add(program(1, ProgramEventKind::ended));
  EXPECT_EQ(sut.program_of(press_1), nullptr);
}

TEST(APlant, KeepsTheNameOfAProgramThatALaterEventLeavesOut) {
  Plant sut;
  sut.add(program(1, ProgramEventKind::started));
  auto event = program(1, ProgramEventKind::on_hold);
  std::get<ProgramEvent>(event.sample).program.clear();
  sut.add(event);
  EXPECT_EQ(sut.program_of(press_1)->event.program, "good.nc");
}

TEST(APlant, DoesNotKnowTheProgramOfAChannelWithoutAGateway) {
  Plant sut;
  sut.add(machine("press", true));
  sut.add(program(1, ProgramEventKind::aborted));
  sut.add(gone_machine("press"));
  EXPECT_EQ(sut.program_of(press_1), nullptr);
  sut.add(machine("press", true));
  EXPECT_NE(sut.program_of(press_1), nullptr) << "the same gateway publishes changes only";
}

TEST(APlant, KnowsTheErrorThatTheNextGatewayFindsAndForgetsOneThatItDoesNotFind) {
  for (const bool stands : {true, false}) {
    Plant sut;
    sut.add(machine("press", true));
    sut.add(program(1, ProgramEventKind::aborted));
    sut.add(gone_machine("press"));
    // Its events may come before its status.
    if (stands) {
      auto found = program(1, ProgramEventKind::aborted);
      std::get<ProgramEvent>(found.sample).started = {};
      std::get<ProgramEvent>(found.sample).program.clear();
      sut.add(found);
    }
    auto next = machine_status("press", true);
    next.gateway = id(98);
    sut.add(entry(next));
    ASSERT_EQ(sut.program_of(press_1) != nullptr, stands);
    if (stands) {
      EXPECT_EQ(sut.program_of(press_1)->event.program, "good.nc");
    }
  }
}

TEST(APlant, DropsAChannelThatItsGatewayHasNoLongerButKeepsThoseOfAGatewayThatIsGone) {
  Plant sut;
  sut.add(machine("press", true));
  sut.add(channel(1, ChannelState::idle));
  auto gone = channel_status(1, ChannelState::link_down);
  gone.gone = true;
  sut.add(entry(gone));
  sut.add(gone_machine("press"));
  EXPECT_THAT(sut.channels(), SizeIs(1));
  sut.add(machine("press", true));
  EXPECT_THAT(sut.channels(), IsEmpty());
}

TEST(APlant, KeepsALimitedNumberOfPrograms) {
  Plant sut;
  for (std::uint16_t i = 0; i < Plant::most_programs; ++i) {
    EXPECT_TRUE(sut.add(program(i, ProgramEventKind::started)));
  }
  EXPECT_FALSE(sut.add(program(Plant::most_programs, ProgramEventKind::started)));
}

}  // namespace
}  // namespace millrace::fabric::plant
