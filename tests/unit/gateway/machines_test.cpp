#include "tests/unit/gateway/machines.hpp"

#include <gmock/gmock.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

const std::string other = "gateway 000000000002 (pid 1 on host7)";

TEST_F(MachinesTest, ServesAfterItHasListened) {
  EXPECT_FALSE(linked);
  serve();
  EXPECT_THAT(served, ElementsAre(1, 2));
}

TEST_F(MachinesTest, ContinuesListeningWhereItsTimersAreLate) {
  time_passes(100ms);
  EXPECT_FALSE(linked);
  serve();
  EXPECT_THAT(served, ElementsAre(1, 2));
}

TEST_F(MachinesTest, ServesInTheEndWhereItsTimersAreAlwaysLate) {
  for (int times = 0; times < 20 && !linked; ++times) {
    time_passes(100ms);
  }
  EXPECT_TRUE(linked);
}

TEST_F(MachinesTest, AreReleasedWhereOthersMayHaveTakenThemOverDuringAStandstill) {
  serve();
  EXPECT_FALSE(sut.on_stall(time));
  EXPECT_TRUE(linked);
  sut.on_machine(claim(2h), time);
  EXPECT_TRUE(sut.on_stall(time));
  EXPECT_FALSE(linked);
}

TEST_F(MachinesTest, ArePublishedAgainAfterAStandstill) {
  serve();
  const int before = times_told;
  EXPECT_FALSE(sut.on_stall(time));
  EXPECT_EQ(times_told, before + 1);
  EXPECT_TRUE(told.connected);
}

// A gateway that took this one for gone has forgotten its samples.
TEST_F(MachinesTest, ArePublishedAgainToAGatewayThatServesThemToo) {
  serve();
  auto later = claim(2h);
  later.connected = false;
  sut.on_machine(later, time);
  const int before = times_told;
  later.connected = true;
  sut.on_machine(later, time);
  EXPECT_EQ(times_told, before + 1);
}

// Otherwise two gateways with the same machine would publish to each other endlessly.
TEST_F(MachinesTest, AreNotPublishedAgainByTheLaterGateway) {
  auto first = claim(1s);
  first.claims = {7};
  sut.on_machine(first, time);
  serve();
  const int before = times_told;
  sut.on_machine(first, time);
  EXPECT_EQ(times_told, before);
}

TEST_F(MachinesTest, IgnoreARemovedLink) {
  serve();
  sut.on_machine(claim(2h), time);
  sut.on_stall(time);
  sut.on_link_up("cnc", {1}, time);
  EXPECT_FALSE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_FALSE(told.connected);
}

TEST_F(MachinesTest, DoesNotConnectToAMachineThatAnotherOneServes) {
  sut.on_machine(claim(1s), time);
  time_passes();
  EXPECT_FALSE(linked);
  EXPECT_FALSE(told.connected);
}

TEST_F(MachinesTest, InheritsTheCallOfAGatewayThatIsGone) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other)));
}

// A regression: a gateway that had stood still received the state of a call before its dispatch,
// not after it, and dispatched it again. Found by the simulation.
TEST_F(MachinesTest, InheritsACallWhoseLastKnownStateIsWaiting) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 0), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other)));
}

// A regression: it was overwritten by the channel's state from a gateway without a link, or from
// this one itself. Found by the simulation.
TEST_F(MachinesTest, InheritsACallThatAnotherGatewayDoesNotHave) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  auto nothing = call(other_epoch, fabric::ChannelState::link_down, 0);
  nothing.call = {};
  sut.on_channel(nothing, time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other)));
}

TEST_F(MachinesTest, InheritsNothingOfAGatewayThatEndsInOrder) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 0), time);
  auto last = call(other_epoch, fabric::ChannelState::idle, 0);
  last.call = {};
  sut.on_channel(last, time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, IsEmpty());
}

// A regression: the state of a restarted gateway that had blocked a call of its journal was
// misunderstood, and the at-most-once call ran twice. Found by the simulation.
TEST_F(MachinesTest, InheritsACallThatTheOtherGatewayHasFromItsJournal) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::link_down, 0), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other)));
}

// A regression: after two gateways had not heard each other, the one that continued to serve
// ignored what the other had done. Found by the simulation.
TEST_F(MachinesTest, InheritsFromAnotherGatewayThatServedTheSameMachine) {
  serve();
  sut.on_machine(claim(2h), time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other)));
}

// Found by the simulation.
TEST_F(MachinesTest, InheritsACallReportedBeforeItsConfigurationNamedTheMachine) {
  serve();
  sut.set({}, time);
  served.clear();
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  settings::MachineSettings machine;
  machine.name = "cnc";
  sut.set({machine}, time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, "")));
}

// Found by the simulation.
TEST_F(MachinesTest, InheritsNothingFromItself) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(own_epoch, fabric::ChannelState::running, 1), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, IsEmpty());
}

TEST_F(MachinesTest, AreNotStoppedByAnImpossibleOwnershipTime) {
  serve();
  const std::size_t before = said.size();
  for (int i = 0; i < 10'000; ++i) {
    auto liar = claim(0s);
    liar.gateway = fabric::InstanceId::random();
    liar.claimed = i % 2 == 0 ? fabric::Time(1ns) : fabric::Time::max();
    sut.on_machine(liar, time);
  }
  EXPECT_TRUE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  ASSERT_EQ(said.size(), before + 1) << "reported once";
  EXPECT_THAT(said.back(), testing::HasSubstr("claimed=1"));
}

TEST_F(MachinesTest, InheritNothingOfAnotherControllerOfTheirName) {
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.net_id = cnc::ads::NetId{{10, 0, 0, 7, 1, 1}};
  sut.set({machine}, time);
  time_passes();
  auto namesake = claim(1s);
  namesake.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  sut.on_machine(namesake, time);
  serve();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(predecessor_calls, IsEmpty());
  EXPECT_THAT(said, testing::Contains(testing::HasSubstr("another controller")));
}

TEST_F(MachinesTest, RememberALimitedNumberOfChannelsOfOthers) {
  for (std::size_t i = 0; i < 16'384 + 100; ++i) {
    auto status = call(other_epoch, fabric::ChannelState::running, 1);
    status.key = {"m" + std::to_string(i / 50), static_cast<std::uint16_t>(1 + i % 50)};
    sut.on_channel(status, time);
  }
  ASSERT_THAT(said, testing::SizeIs(1)) << "reported once";
  EXPECT_THAT(said.back(), testing::HasSubstr("of more than 16384 channels"));
}

}  // namespace
}  // namespace millrace::gateway
