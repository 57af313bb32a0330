#include "tests/unit/gateway/machines.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "gateway/machines/claims.hpp"
#include "gateway/machines/machine_status_writer.hpp"

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsNull;
using testing::NotNull;
using testing::Pair;
using testing::SizeIs;

const std::string other_gateway = "gateway 000000000002 (pid 1 on host7)";

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

TEST_F(MachinesTest, ContinuesListeningWhileAParticipantIsNotAuthenticated) {
  ports.unauthenticated = true;
  time_passes();
  EXPECT_FALSE(linked);
  ports.unauthenticated = false;
  serve();
  EXPECT_THAT(served, ElementsAre(1, 2));
}

TEST_F(MachinesTest, ServesInTheEndBesideAParticipantThatIsNeverAuthenticated) {
  const SteadyTime begin = time.steady;
  ports.unauthenticated = true;
  time_passes_until_linked();
  EXPECT_LE(time.steady - begin, 3s + 300ms);
}

TEST_F(MachinesTest, ServesInTheEndWhereItsTimersAreAlwaysLate) {
  time_passes_until_linked(100ms);
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
  const int before = times_published;
  EXPECT_FALSE(sut.on_stall(time));
  EXPECT_EQ(times_published, before + 1);
  EXPECT_TRUE(published.connected);
}

// A gateway that took this one for gone has forgotten its samples.
TEST_F(MachinesTest, ArePublishedAgainToAGatewayThatServesThemToo) {
  serve();
  auto later = claim(2h);
  later.connected = false;
  sut.on_machine(later, time);
  const int before = times_published;
  later.connected = true;
  sut.on_machine(later, time);
  EXPECT_EQ(times_published, before + 1);
}

// Otherwise two gateways with the same machine would publish to each other endlessly.
TEST_F(MachinesTest, AreNotPublishedAgainByTheLaterGateway) {
  auto first = claim(1s);
  first.claims = {7};
  sut.on_machine(first, time);
  serve();
  const int before = times_published;
  sut.on_machine(first, time);
  EXPECT_EQ(times_published, before);
}

TEST_F(MachinesTest, IgnoreARemovedLink) {
  serve();
  sut.on_machine(claim(2h), time);
  sut.on_stall(time);
  sut.on_link_up("cnc", {1}, time);
  EXPECT_FALSE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_FALSE(published.connected);
}

TEST_F(MachinesTest, DoesNotConnectToAMachineThatAnotherOneServes) {
  sut.on_machine(claim(1s), time);
  time_passes();
  EXPECT_FALSE(linked);
  EXPECT_FALSE(published.connected);
}

TEST_F(MachinesTest, InheritsTheCallOfAGatewayThatIsGone) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
}

// A call is inherited when its channel is served again, and not before.
TEST_F(MachinesTest, InheritsACallReportedWhileItsLinkIsDown) {
  serve();
  sut.on_link_down("cnc", {"the controller does not answer"}, time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(predecessor_calls, IsEmpty());
  sut.on_link_up("cnc", {1, 2}, time);
  EXPECT_THAT(predecessor_calls, SizeIs(1));
}

// The link stays, since a response is still being written.
TEST_F(MachinesTest, InheritsACallReportedWhileItStandsByOnTheSameLink) {
  serve();
  sut.on_machine(claim(1s), time);
  ASSERT_TRUE(linked);
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(predecessor_calls, IsEmpty());
  sut.on_machine_gone("cnc", gateway_id(9), time);
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
}

// A regression: a gateway that had stood still received the state of a call before its dispatch,
// not after it, and dispatched it again. Found by the simulation.
TEST_F(MachinesTest, InheritsACallWhoseLastKnownStateIsWaiting) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 0), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
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
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
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
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
}

// A regression: after two gateways had not heard each other, the one that continued to serve
// ignored what the other had done. Found by the simulation.
TEST_F(MachinesTest, InheritsFromAnotherGatewayThatServedTheSameMachine) {
  serve();
  sut.on_machine(claim(2h), time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(predecessor_calls, ElementsAre(Pair(1, other_gateway)));
}

// A regression: a gateway that came back published the call of its journal once more, and the next
// call at most once of the NC program waited for an operator.
TEST_F(MachinesTest, InheritsACallOnceWhereItsGatewayComesBackWithItsJournal) {
  sut.on_machine(claim(1s), time);
  time_passes();
  auto status = call(other_epoch, fabric::ChannelState::running, 1);
  sut.on_channel(status, time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  sut.on_machine(claim(2h), time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::link_down, 1), time);
  EXPECT_THAT(predecessor_calls, SizeIs(1));
  sut.on_link_down("cnc", {"the controller does not answer"}, time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::waiting, 1), time);
  sut.on_link_up("cnc", {1, 2}, time);
  EXPECT_THAT(predecessor_calls, SizeIs(1));
  ++status.call.number;
  sut.on_channel(status, time);
  EXPECT_THAT(predecessor_calls, SizeIs(2)) << "a later call of a gateway that serves it, too";
}

TEST_F(MachinesTest, InheritsACallAgainThatItsGatewayHasContinued) {
  sut.on_machine(claim(1s), time);
  time_passes();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  serve();
  ASSERT_THAT(predecessor_calls, SizeIs(1));
  sut.on_machine(claim(1s), time);
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  sut.on_machine_gone("cnc", gateway_id(9), time);
  EXPECT_THAT(predecessor_calls, SizeIs(2));
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

TEST_F(MachinesTest, OwnAChannelThatIsNewInTheConfigurationFromThenOn) {
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.channels = {1, 2};
  sut.set({machine}, time);
  serve();
  const fabric::Time first = published.claimed;
  time.wall += 1h;
  machine.channels = {2};
  sut.set({machine}, time);
  time_passes();
  EXPECT_EQ(published.claimed, first);
  machine.channels = {2, 3};
  sut.set({machine}, time);
  time_passes();
  EXPECT_EQ(published.claimed, time.wall);
}

TEST_F(MachinesTest, AskForAVariableAtOnce) {
  serve();
  sut.on_request({.requester = gateway_id(3), .key = {"cnc", 1}, .names = {"V.E.A"}}, time);
  sut.ask_values(time);
  EXPECT_EQ(ports.questions, 1);
}

TEST_F(MachinesTest, SaysThatAMachineWasRemovedOnceItsCallsAreOver) {
  serve();
  sut.set({}, time);
  time_passes();
  EXPECT_THAT(ports.given_up, IsEmpty()) << "a call is under way";
  served.clear();
  sut.on_over({"cnc", 1});
  sut.finish(time);
  ASSERT_THAT(ports.given_up, SizeIs(1));
  EXPECT_EQ(ports.given_up[0].machine, "cnc");
  EXPECT_EQ(ports.given_up[0].reason, base::messages::machine_removed());
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
  const std::size_t before = log_lines.size();
  for (int i = 0; i < 10'000; ++i) {
    auto liar = claim(0s);
    liar.gateway = fabric::InstanceId::random();
    liar.claimed = i % 2 == 0 ? fabric::Time(1ns) : fabric::Time::max();
    sut.on_machine(liar, time);
  }
  EXPECT_TRUE(linked);
  EXPECT_THAT(served, ElementsAre(1, 2));
  ASSERT_EQ(log_lines.size(), before + 1) << "reported once";
  EXPECT_THAT(log_lines.back(), testing::HasSubstr("claimed=1"));
}

TEST_F(MachinesTest, InheritNothingOfAnotherControllerOfTheirName) {
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.controller.net_id = cnc::ads::NetId{{10, 0, 0, 7, 1, 1}};
  sut.set({machine}, time);
  time_passes();
  auto namesake = claim(1s);
  namesake.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  sut.on_machine(namesake, time);
  serve();
  sut.on_channel(call(other_epoch, fabric::ChannelState::running, 1), time);
  EXPECT_THAT(served, ElementsAre(1, 2));
  EXPECT_THAT(predecessor_calls, IsEmpty());
  EXPECT_THAT(log_lines, testing::Contains(testing::HasSubstr("another controller")));
}

TEST_F(MachinesTest, RememberALimitedNumberOfChannelsOfOthers) {
  for (std::size_t i = 0; i < 16'384 + 100; ++i) {
    auto status = call(other_epoch, fabric::ChannelState::running, 1);
    status.key = {"m" + std::to_string(i / 50), static_cast<std::uint16_t>(1 + i % 50)};
    sut.on_channel(status, time);
  }
  ASSERT_THAT(log_lines, testing::SizeIs(1)) << "reported once";
  EXPECT_THAT(log_lines.back(), testing::HasSubstr("of more than 16384 channels"));
}

fabric::InstanceId gateway(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

fabric::Time at(std::chrono::seconds time) {
  return machines::Claims::earliest + time;
}

fabric::MachineStatus claim(std::uint8_t number, std::chrono::seconds since,
                            std::vector<std::uint16_t> channels = {}) {
  fabric::MachineStatus status;
  status.machine = "cnc";
  status.gateway = gateway(number);
  status.claimed = at(since);
  status.claims = std::move(channels);
  status.host = "host7";
  status.pid = 4711;
  status.epoch = 0x5f3a9c0112d4;
  return status;
}

class ClaimsTest : public testing::Test {
 protected:
  machines::Claims sut{gateway(5)};
};

TEST_F(ClaimsTest, LetTheEarlierGatewayServe) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(11s)), NotNull());
}

TEST_F(ClaimsTest, DecideBetweenTwoOfOneMomentByTheirIds) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(10s)), NotNull());
  sut.remove("cnc", gateway(1));
  sut.set(claim(9, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(10s)), IsNull());
}

TEST_F(ClaimsTest, ConcernTheChannelsTheyNameOrAll) {
  sut.set(claim(1, 1s, {2}));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_before({"cnc", 2}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_before({"press", 2}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, CoverAMachineOnlyIfTheyCoverAllRequestedChannels) {
  sut.set(claim(1, 1s, {1, 2}));
  EXPECT_THAT(sut.owner_of_all_before("cnc", {2}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {2, 3}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(0s)), IsNull());
}

TEST_F(ClaimsTest, AreVoidOnceTheirGatewayIsGone) {
  sut.set(claim(1, 1s));
  EXPECT_TRUE(sut.contested("cnc"));
  sut.remove("cnc", gateway(1));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, OfOthersStandWhenAGatewayIsGone) {
  sut.set(claim(1, 1s));
  sut.set(claim(2, 2s));
  sut.remove("cnc", gateway(1));
  EXPECT_TRUE(sut.contested("cnc"));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, OfOurOwnAreIgnored) {
  sut.set(claim(5, 1s));
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, ComeAfterServingGatewaysWhateverTheClocks) {
  sut.set(claim(1, 60s));
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(5s));
  auto serving = claim(2, 50s);
  serving.connected = true;
  sut.set(serving);
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(50s) + 1ns);
  EXPECT_EQ(sut.after_owners("cnc", at(55s)), at(55s));
}

// Regressions: one such sample stopped a machine, and the other one made the next gateway wait for
// ever.
TEST_F(ClaimsTest, OfImpossibleTimesAreIgnored) {
  using Accepted = machines::Claims::Accepted;
  for (const auto time : {fabric::Time(1ns), fabric::Time::min(), fabric::Time::max()}) {
    auto liar = claim(1, 10s);
    EXPECT_EQ(sut.set(liar), Accepted::yes);
    liar.claimed = time;
    liar.connected = true;
    EXPECT_EQ(sut.set(liar), Accepted::implausible);
    EXPECT_THAT(sut.owner_before({"cnc", 1}, at(11s)), IsNull());
    EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(11s)), IsNull());
    EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(5s));
    EXPECT_FALSE(sut.contested("cnc"));
  }
}

TEST_F(ClaimsTest, HavePlausibleTimesWhateverOurClock) {
  EXPECT_EQ(machines::plausible(fabric::Time(1h)), machines::Claims::earliest);
  EXPECT_EQ(machines::plausible(fabric::Time::max()), machines::Claims::latest);
  EXPECT_EQ(machines::plausible(at(7s)), at(7s));
  auto last = claim(1, 0s);
  last.claimed = machines::Claims::latest;
  last.connected = true;
  sut.set(last);
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), machines::Claims::latest);
}

TEST_F(ClaimsTest, OfAnotherControllerOfTheSameNameHaveNoEffect) {
  using Accepted = machines::Claims::Accepted;
  sut.set_address("cnc", "10.0.0.7:48898, 10.0.0.7.1.1");
  auto namesake = claim(1, 1s);
  namesake.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  namesake.connected = true;
  EXPECT_EQ(sut.set(namesake), Accepted::another_controller);
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {1}, at(9s)), IsNull());
  EXPECT_FALSE(sut.contested("cnc"));
  EXPECT_EQ(sut.after_owners("cnc", at(0s)), at(0s));
  EXPECT_TRUE(sut.is_elsewhere("cnc", namesake.epoch));
  namesake.address = "gate:48898, 10.0.0.7.1.1";
  EXPECT_EQ(sut.set(namesake), Accepted::yes) << "another way to the same controller";
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

// The address is relative to its own host; without a host name, it may be the same controller.
TEST_F(ClaimsTest, CountWhereTheControllerIsUnknown) {
  sut.set_address("cnc", "10.0.0.7:48898, 10.0.0.7.1.1");
  for (const char* address : {"", "nonsense", "127.0.0.1:48898, 127.0.0.1.1.1", "a, b"}) {
    auto other = claim(1, 1s);
    other.address = address;
    sut.set(other);
    EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull()) << address;
  }
}

TEST_F(ClaimsTest, CountWhereOurOwnControllerIsKnownByItsHostOnly) {
  sut.set_address("cnc", "127.0.0.1:48898, 127.0.0.1.1.1");
  auto other = claim(1, 1s);
  other.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  EXPECT_EQ(sut.set(other), machines::Claims::Accepted::yes);
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, AreLimitedInNumber) {
  using Accepted = machines::Claims::Accepted;
  sut.set_address("cnc", "");
  std::size_t taken = 0;
  for (int i = 0; i < 3000; ++i) {
    auto other = claim(1, 1s);
    other.machine = "machine" + std::to_string(i);
    taken += sut.set(other) == Accepted::yes ? 1U : 0U;
  }
  EXPECT_EQ(taken, machines::Claims::most_machines);
  taken = 0;
  for (int i = 0; i < 3000; ++i) {
    auto other = claim(1, 1s);
    other.gateway.bytes[0] = static_cast<std::uint8_t>(i);
    other.gateway.bytes[1] = static_cast<std::uint8_t>(i / 256);
    taken += sut.set(other) == Accepted::yes ? 1U : 0U;
  }
  EXPECT_EQ(taken, machines::Claims::most_gateways) << "ours leave room for others";
  // When one is gone there is room for one more; there is always room for ours.
  sut.remove("machine0", gateway(1));
  sut.remove("machine1", gateway(1));
  auto next = claim(1, 1s);
  next.machine = "next";
  EXPECT_EQ(sut.set(next), Accepted::yes);
}

TEST_F(ClaimsTest, NameTheirGateway) {
  EXPECT_EQ(machines::name_of(claim(1, 1s)), "gateway 5f3a9c0112d4 (pid 4711 on host7)");
}

Moment moment(std::chrono::seconds time) {
  return {SteadyTime(time), fabric::Time(time)};
}

using enum fabric::WatchMode;

class MachineStatusWriterTest : public testing::Test {
 protected:
  machines::MachineStatusWriter sut{fabric::MachineStatus{.machine = "cnc"}};
};

TEST_F(MachineStatusWriterTest, ReportsSinceWhenTheLinkIsUp) {
  sut.on_down("connecting", moment(1s));
  sut.on_up(2, polled, "", moment(5s));
  sut.on_up(1, pushed, "channel 2 is served by another", moment(7s));
  const auto news = sut.take_change();
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->connected);
  EXPECT_EQ(news->since, fabric::Time(5s));
  EXPECT_EQ(news->channels, 1);
  EXPECT_EQ(news->watch, pushed);
  EXPECT_EQ(news->reason, "channel 2 is served by another");
}

TEST_F(MachineStatusWriterTest, ReportsWhyTheLinkIsDownAndSinceWhen) {
  sut.on_up(2, polled, "", moment(1s));
  sut.on_down("connection reset", moment(5s));
  sut.on_down("connection refused", moment(6s));
  const auto news = sut.take_change();
  ASSERT_TRUE(news);
  EXPECT_FALSE(news->connected);
  EXPECT_EQ(news->since, fabric::Time(5s));
  EXPECT_EQ(news->reason, "connection refused");
  EXPECT_EQ(news->channels, 0);
  EXPECT_EQ(news->watch, none);
}

TEST_F(MachineStatusWriterTest, ReportsASilentControllerAsDownSinceItsLastResponse) {
  sut.on_up(1, polled, "", moment(1s));
  sut.on_down("does not answer", moment(60s), 2100ms);
  EXPECT_EQ(sut.status().since, fabric::Time(57900ms));
}

TEST_F(MachineStatusWriterTest, ReportsEachStateOnce) {
  sut.on_up(2, polled, "", moment(1s));
  EXPECT_TRUE(sut.take_change());
  EXPECT_FALSE(sut.take_change());
  sut.on_up(2, polled, "", moment(3s));
  EXPECT_FALSE(sut.take_change());
}

TEST_F(MachineStatusWriterTest, CountsRequestsAndTheTimeUntilTheirAnswers) {
  sut.on_load({.requests = 100, .answered = 100, .waited = 5s}, moment(1s).steady);
  sut.on_load({.requests = 300, .answered = 200, .waited = 6s}, moment(3s).steady);
  EXPECT_EQ(sut.status().requests_per_second, 100U);
  EXPECT_EQ(sut.status().round_trip, 10ms);
}

TEST_F(MachineStatusWriterTest, StartsOverWithANewLink) {
  sut.on_load({.requests = 100, .answered = 100, .waited = 5s}, moment(1s).steady);
  sut.on_load({.requests = 10, .answered = 10, .waited = 10ms}, moment(2s).steady);
  EXPECT_EQ(sut.status().requests_per_second, 10U);
  EXPECT_EQ(sut.status().round_trip, 1ms);
}

TEST_F(MachineStatusWriterTest, ShowsNoRoundTripWithoutAnAnswer) {
  sut.on_load({}, moment(1s).steady);
  sut.on_load({.requests = 4}, moment(2s).steady);
  EXPECT_EQ(sut.status().round_trip, 0ns);
}

}  // namespace
}  // namespace millrace::gateway
