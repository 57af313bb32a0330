#include "tools/bus/fabric_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/bus/snapshot.hpp"

namespace millrace::tools::bus {
namespace {

using namespace std::chrono_literals;
using recording::Change;
using recording::Entry;
using recording::InstanceNews;
using testing::IsEmpty;
using testing::SizeIs;

const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

fabric::InstanceId instance(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

Entry news(Change change, std::uint8_t byte, const std::string& name) {
  InstanceNews what{.change = change, .identity = {.id = instance(byte)}};
  what.identity.uuid = square_root;
  what.identity.name = name;
  return {.sample = what};
}

Entry load(std::uint8_t byte, std::uint64_t answered) {
  return {.sample = fabric::InstanceStatus{.instance = instance(byte), .answered = answered}};
}

TEST(AFabricModel, HasAnInstanceUntilItIsGone) {
  FabricModel sut;
  sut.add(news(Change::ready, 1, "a"));
  sut.add(news(Change::changed, 1, "b"));
  EXPECT_EQ(sut.instances().at(instance(1)).identity.name, "b");
  EXPECT_EQ(sut.instances().at(instance(1)).status, std::nullopt);
  sut.add(news(Change::gone, 1, ""));
  EXPECT_THAT(sut.instances(), IsEmpty());
}

TEST(AFabricModel, HasInstancesThatAreGoneUntilTheyAreForgotten) {
  FabricModel sut;
  sut.add(news(Change::ready, 1, "a"));
  Entry gone = news(Change::gone, 1, "");
  gone.at = fabric::Time(std::chrono::seconds(100));
  sut.add(gone);
  ASSERT_THAT(sut.gone(), SizeIs(1));
  EXPECT_EQ(sut.gone().at(instance(1)).last.identity.name, "a");
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

TEST(AFabricModel, HasTheProcessOfTheGatewayOfALostMachine) {
  FabricModel sut;
  const auto machine = [&](std::uint8_t gateway, const std::string& host) {
    sut.add({.sample = fabric::MachineStatus{.machine = "cnc",
                                             .gateway = instance(gateway),
                                             .since = fabric::Time(std::chrono::seconds(7)),
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
  EXPECT_EQ(sut.lost()[0].since, fabric::Time(std::chrono::seconds(7)));
  machine(2, "hall");
  EXPECT_THAT(sut.lost(), IsEmpty());
}

TEST(AFabricModel, LosesTheMachinesOfOneOfTwoGatewaysOfAHost) {
  FabricModel sut;
  const auto machine = [&](const std::string& name, std::uint8_t gateway, bool gone) {
    sut.add({.sample = fabric::MachineStatus{.machine = name,
                                             .gateway = instance(gateway),
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
  EXPECT_FALSE(sut.machines().at({"cnc", instance(1)}).gone);
}

TEST(AFabricModel, KeepsTheStatusOfAnInstanceBeforeItsDiscovery) {
  FabricModel sut;
  sut.add(load(1, 5));
  EXPECT_THAT(sut.instances(), IsEmpty());
  sut.add(news(Change::ready, 1, "a"));
  EXPECT_EQ(sut.instances().at(instance(1)).status->answered, 5U);
  sut.add(load(1, 6));
  EXPECT_EQ(sut.instances().at(instance(1)).status->answered, 6U);
}

TEST(AFabricModel, FindsInstancesByUuidIdOrName) {
  FabricModel sut;
  sut.add(news(Change::ready, 1, "a"));
  sut.add(news(Change::ready, 2, "b"));
  EXPECT_THAT(sut.instances_of("560AACBF-6335-44A9-895A-8B27F3ED5E47"), SizeIs(2));
  EXPECT_THAT(sut.instances_of(instance(2).to_string()), SizeIs(1));
  EXPECT_THAT(sut.instances_of("a"), SizeIs(1));
  EXPECT_THAT(sut.instances_of("A"), IsEmpty());
  EXPECT_THAT(sut.instances_of(""), SizeIs(2));
}

TEST(AFabricModel, HasTheNewestOfChannelsAndMachines) {
  FabricModel sut;
  for (const auto state : {fabric::ChannelState::running, fabric::ChannelState::idle}) {
    sut.add({.sample = fabric::ChannelStatus{.key = {"cnc", 1}, .state = state}});
  }
  for (const bool connected : {false, true}) {
    sut.add({.sample = fabric::MachineStatus{.machine = "cnc", .connected = connected}});
  }
  EXPECT_EQ(sut.channels().at({"cnc", 1}).state, fabric::ChannelState::idle);
  EXPECT_TRUE(sut.machines().at({"cnc", {}}).connected);
}

TEST(AFabricModel, ReportsWhetherAProcessIsNew) {
  FabricModel sut;
  EXPECT_TRUE(sut.add(news(Change::ready, 1, "a")));
  EXPECT_FALSE(sut.add(news(Change::ready, 1, "a")));
  EXPECT_TRUE(sut.add(news(Change::gone, 1, "a")));
  EXPECT_FALSE(sut.add(news(Change::gone, 1, "a")));
  const recording::Entry channel{.sample = fabric::ChannelStatus{.key = {"cnc", 1}}};
  EXPECT_TRUE(sut.add(channel));
  EXPECT_FALSE(sut.add(channel));
  const recording::Entry machine{.sample = fabric::MachineStatus{.machine = "cnc"}};
  EXPECT_TRUE(sut.add(machine));
  EXPECT_FALSE(sut.add(machine));
  EXPECT_FALSE(sut.add({.sample = fabric::InstanceStatus{.instance = instance(1)}}));
}

TEST(AFabricModel, KeepsApartTwoGatewaysOfOneMachine) {
  FabricModel sut;
  const fabric::InstanceId first = instance(1), second = instance(2);
  sut.add({.sample = fabric::MachineStatus{.machine = "cnc", .gateway = first, .connected = true}});
  sut.add({.sample = fabric::MachineStatus{.machine = "cnc", .gateway = second}});
  EXPECT_TRUE(sut.machines().at({"cnc", first}).connected);
  EXPECT_FALSE(sut.machines().at({"cnc", second}).connected);
}

TEST(AFabricModel, HasAnAlarmUntilItIsRetracted) {
  FabricModel sut;
  fabric::Alarm alarm{.key = {instance(1), "archive", ""}, .text = "disk full"};
  EXPECT_TRUE(sut.add(alarm));
  alarm.text = "disk gone";
  EXPECT_FALSE(sut.add(alarm));
  EXPECT_EQ(sut.alarms().at(alarm.key).text, "disk gone");
  sut.take_back(alarm.key);
  EXPECT_THAT(sut.alarms(), IsEmpty());
}

TEST(AFabricModel, KeepsALimitedNumberOfAlarms) {
  FabricModel sut;
  for (std::size_t i = 0; i < FabricModel::most_alarms; ++i) {
    sut.add(fabric::Alarm{.key = {instance(1), "flood", std::to_string(i)}});
  }
  EXPECT_FALSE(sut.too_many_alarms());
  EXPECT_FALSE(sut.add(fabric::Alarm{.key = {instance(1), "flood", "one more"}}));
  EXPECT_TRUE(sut.too_many_alarms());
  EXPECT_THAT(sut.alarms(), SizeIs(FabricModel::most_alarms));
}

TEST(AFabricModel, HasAnAlarmOfARecordingUntilItIsOver) {
  FabricModel sut;
  const fabric::Alarm alarm{.key = {instance(1), "archive", ""}, .text = "disk full"};
  EXPECT_TRUE(sut.add(Entry{.sample = recording::AlarmNews{.alarm = alarm}}));
  EXPECT_EQ(sut.alarms().at(alarm.key), alarm);
  sut.add(Entry{.sample = recording::AlarmNews{.over = true, .alarm = alarm}});
  EXPECT_THAT(sut.alarms(), IsEmpty());
}

TEST(AFabricModel, NamesTheCauseOfACallThatDoesNotContinue) {
  using enum fabric::ChannelState;
  FabricModel sut;
  const fabric::Time now(std::chrono::hours(1));
  fabric::ChannelStatus status{
      .key = {"cnc", 1}, .state = waiting, .since = now, .uuid = square_root};
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::unserved) << "no instance is left";
  sut.add(news(Change::ready, 1, "a"));
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::busy);
  EXPECT_EQ(sut.obstacle_of(status, now + std::chrono::seconds(60)), Obstacle::busy);
  EXPECT_EQ(sut.obstacle_of(status, now + std::chrono::seconds(61)), Obstacle::long_busy);
  status.state = held;
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::held);
  status.state = unserved;
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::unserved);
  sut.add({.sample = fabric::MachineStatus{.machine = "cnc", .gateway = instance(7)}});
  sut.add(fabric::Alarm{.key = {instance(7), "journal", ""}, .text = "disk full"});
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::journal);
  status.state = running;
  EXPECT_EQ(sut.obstacle_of(status, now), Obstacle::none);
}

// How long a command listens to a fabric.

class ListeningTimeTest : public testing::Test {
 protected:
  const ListeningTime::Clock::time_point start{1h};
  ListeningTime sut{{.at_least = 700ms, .quiet = 200ms, .at_most = 5s, .authentication = 3s},
                    start};
};

TEST_F(ListeningTimeTest, IsAsLongAsDiscoveryTakes) {
  sut.on_news(start + 100ms);
  sut.on_timer(start + 50ms, start + 70ms);
  EXPECT_EQ(sut.end(), start + 700ms);
}

TEST_F(ListeningTimeTest, ContinuesUntilNoNewProcessComes) {
  sut.on_news(start + 650ms);
  EXPECT_EQ(sut.end(), start + 850ms);
}

TEST_F(ListeningTimeTest, StartsAgainWhereATimerIsLateAsOnABusyHost) {
  sut.on_timer(start + 400ms, start + 421ms);
  EXPECT_EQ(sut.end(), start + 1121ms);
  sut.on_timer(start + 450ms, start + 451ms);
  EXPECT_EQ(sut.end(), start + 1121ms) << "a timer on time changes nothing";
}

TEST_F(ListeningTimeTest, WaitsForTheProofOfAnAnnouncedParticipant) {
  EXPECT_EQ(sut.end(true), start + 3s);
  EXPECT_EQ(sut.end(false), start + 700ms);
}

TEST_F(ListeningTimeTest, EndsAlsoOnAHostThatIsAlwaysBusy) {
  sut.on_timer(start + 4900ms, start + 4950ms);
  sut.on_news(start + 4950ms);
  EXPECT_EQ(sut.end(), start + 5s);
}

}  // namespace
}  // namespace millrace::tools::bus
