// A machine with notifications.
#include <gmock/gmock.h>

#include "tests/unit/gateway/machines.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;

class SubscribedMachine : public MachinesTest {
 protected:
  void be_trusted() {
    serve();
    sut.on_subscribed("cnc", {{1, "", false}, {2, "", false}}, time);
    for (const std::uint16_t channel : Channels{1, 2}) {
      sut.on_notification({"cnc", channel}, Variable::request_state, 0, time);
      look(channel, 0);
    }
  }
  void look(std::uint16_t channel, std::uint32_t state) {
    ServiceSnapshot snapshot;
    snapshot.set = ReadSet::state;
    snapshot.request_state = state;
    sut.on_read({"cnc", channel}, snapshot, time);
  }
};

TEST_F(SubscribedMachine, IsSubscribedForItsServedChannelsAndReportsThat) {
  be_trusted();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_THAT(trusted, ElementsAre(Pair(1, true), Pair(2, true)));
  EXPECT_TRUE(told.connected);
  EXPECT_EQ(told.watch, fabric::WatchMode::pushed);
}

TEST_F(SubscribedMachine, ReportsAChangeButNotTheGatewaysOwnWrite) {
  be_trusted();
  changed.clear();
  sut.on_notification({"cnc", 2}, Variable::request_state, 7, time);
  EXPECT_THAT(changed, ElementsAre(2));
  look(2, 7);
  sut.write({"cnc", 2}, Variable::request_state, Value(0U));
  EXPECT_TRUE(trusted[2]) << "no read has shown it yet";
  look(2, 0);
  EXPECT_FALSE(trusted[2]) << "until the controller has notified it";
  sut.on_notification({"cnc", 2}, Variable::request_state, 0, time);
  EXPECT_TRUE(trusted[2]);
  EXPECT_THAT(changed, ElementsAre(2));
}

TEST_F(SubscribedMachine, AWriteThatNoReadShowsHasChangedNothing) {
  be_trusted();
  sut.write({"cnc", 2}, Variable::request_state, Value(9U));
  EXPECT_TRUE(trusted[2]);
}

TEST_F(SubscribedMachine, IsSubscribedAgainOnANewLink) {
  be_trusted();
  sut.on_link_down("cnc", "cable", time);
  sut.on_link_up("cnc", {1, 2}, time);
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1, 2)));
  EXPECT_THAT(unwatched, IsEmpty()) << "the controller has forgotten it";
  EXPECT_EQ(told.watch, fabric::WatchMode::polled);
}

TEST_F(SubscribedMachine, ForgetsTheChannelThatAnotherGatewayServes) {
  be_trusted();
  fabric::MachineStatus other_claim = claim(30min);
  other_claim.claims = {2};
  sut.on_machine(other_claim, time);
  EXPECT_THAT(served, ElementsAre(1));
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(2)));
  EXPECT_FALSE(trusted[2]);
  EXPECT_EQ(told.watch, fabric::WatchMode::pushed);
}

TEST_F(SubscribedMachine, FollowsANewConfigurationOnTheSameLink) {
  be_trusted();
  settings::MachineSettings machine;
  machine.name = "cnc";
  machine.watch = SubscriptionMode::poll;
  sut.set({machine}, time);
  EXPECT_TRUE(linked);
  EXPECT_THAT(unwatched, ElementsAre(ElementsAre(1, 2)));
  EXPECT_EQ(told.reason, "polled, as configured");
}

TEST_F(SubscribedMachine, IsSubscribedAgainLaterWhereItDidNotAnswer) {
  serve();
  sut.on_subscribed("cnc", {{1, "no answer", true}, {2, "", false}}, time);
  time_passes();
  EXPECT_THAT(watched, ElementsAre(ElementsAre(1, 2), ElementsAre(1)));
}

}  // namespace
}  // namespace millrace::gateway
