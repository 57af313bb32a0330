// The machines of gateways, as another gateway receives them.
#include "fabric/endpoints/gateway_monitor.hpp"

#include <set>

#include <boost/asio/io_context.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using namespace std::chrono_literals;
using tests::run_until;

struct RecordedMachines final : endpoints::GatewayMonitorListener {
  void on_machine(const MachineStatus& status) override {
    machines.insert(status.machine);
    last = status;
  }
  void on_machine_gone(const std::string& machine, const InstanceId&,
                       endpoints::Absence how) override {
    machines.erase(machine);
    absences.push_back(how);
  }
  void on_channel(const ChannelStatus&) override {}
  void on_ignored(const std::string& reason) override { ignored.push_back(reason); }

  std::set<std::string> machines;
  MachineStatus last;
  std::vector<endpoints::Absence> absences;
  std::vector<std::string> ignored;
};

constexpr std::chrono::milliseconds lease{400};
/// Of a gateway that must stay present: longer than a busy host keeps a test waiting.
constexpr std::chrono::milliseconds long_lease{3000};

dds::ParticipantOptions with_lease(dds::ParticipantOptions options, std::chrono::milliseconds of) {
  options.lease = of;
  return options;
}

class AMonitoredGateway : public testing::Test {
 protected:
  explicit AMonitoredGateway(std::chrono::milliseconds its_lease = lease)
      : there(with_lease(processes.there(), its_lease)) {}

  bool until(const std::function<bool()>& done) { return run_until(context, done); }
  bool until_known() {
    return until([&] { return received.machines.contains("cnc"); });
  }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there;
  RecordedMachines received;
  endpoints::GatewayMonitor monitor{here, context.get_executor(), received};
  RecordingGateway unused;
  endpoints::CallEndpoint sut{there, context.get_executor(), unused};
  MachineStatus status{
      .machine = "cnc", .gateway = InstanceId::random(), .claimed = Time(std::chrono::hours(1))};
};

/// The same gateway, with a second participant that writes its key, too.
class AMonitoredGatewayWithAStranger : public AMonitoredGateway {
 protected:
  AMonitoredGatewayWithAStranger() : AMonitoredGateway(long_lease) {}

  void SetUp() override {
    ASSERT_TRUE(sut.publish(status));
    ASSERT_TRUE(until_known());
    ASSERT_TRUE(until([&] { return !stranger.matched().empty(); }));
  }

  dds::Participant elsewhere{processes.there()};
  wire::Writer<MachineStatus> stranger{elsewhere, "millrace"};
};

TEST_F(AMonitoredGateway, IsPresentAsLongAsItAssertsItsLiveliness) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  const auto later = std::chrono::steady_clock::now() + 4 * lease;
  ASSERT_TRUE(until([&] {
    sut.assert_machines();
    EXPECT_TRUE(received.machines.contains("cnc"));
    return testing::Test::HasFailure() || std::chrono::steady_clock::now() > later;
  }));
}

// DDS's own threads continue to renew the lease of its process.
TEST_F(AMonitoredGateway, IsGoneWithoutItsLivelinessAlthoughItsProcessRuns) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  EXPECT_TRUE(until([&] { return received.machines.empty(); }));
}

TEST_F(AMonitoredGateway, IsSilentWhileDdsKnowsItsProcessAndThenGone) {
  std::optional<dds::Participant> process(std::in_place, with_lease(processes.there(), lease));
  std::optional<endpoints::CallEndpoint> gateway(std::in_place, *process, context.get_executor(),
                                                 unused);
  ASSERT_TRUE(gateway->publish(status));
  ASSERT_TRUE(until([&] { return !received.absences.empty(); }));
  EXPECT_THAT(received.absences, testing::ElementsAre(endpoints::Absence::silent));
  gateway.reset();
  process.reset();
  ASSERT_TRUE(until([&] { return received.absences.size() > 1; }));
  EXPECT_THAT(received.absences,
              testing::ElementsAre(endpoints::Absence::silent, endpoints::Absence::gone));
}

TEST_F(AMonitoredGateway, HasEndedWhenItsProcessLeavesInOrder) {
  std::optional<dds::Participant> process(std::in_place, with_lease(processes.there(), long_lease));
  std::optional<endpoints::CallEndpoint> gateway(std::in_place, *process, context.get_executor(),
                                                 unused);
  ASSERT_TRUE(gateway->publish(status));
  ASSERT_TRUE(until_known());
  gateway.reset();
  process.reset();
  ASSERT_TRUE(until([&] { return !received.absences.empty(); }));
  EXPECT_THAT(received.absences, testing::ElementsAre(endpoints::Absence::ended));
}

TEST_F(AMonitoredGateway, IsNeitherSilentNorGoneWhenItReleasesItsMachine) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  sut.unregister(status);
  ASSERT_TRUE(until([&] { return !received.absences.empty(); }));
  EXPECT_THAT(received.absences, testing::ElementsAre(endpoints::Absence::ended));
}

TEST_F(AMonitoredGateway, SaysThatItsMachineWasRemoved) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  MachineStatus last = status;
  last.reason = base::messages::machine_removed();
  sut.unregister(last);
  ASSERT_TRUE(until([&] { return !received.absences.empty(); }));
  EXPECT_THAT(received.absences, testing::ElementsAre(endpoints::Absence::removed));
}

TEST_F(AMonitoredGateway, IsPresentAgainWhenItRepublishesItsMachines) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  ASSERT_TRUE(until([&] { return received.machines.empty(); }));
  ASSERT_TRUE(sut.publish(status));
  EXPECT_TRUE(until_known());
}

class AMonitoredGatewayWithChannels : public AMonitoredGateway {
 protected:
  struct Channels final : endpoints::GatewayMonitorListener {
    void on_machine(const MachineStatus& of) override { machines.insert(of.gateway); }
    void on_machine_gone(const std::string&, const InstanceId& gateway,
                         endpoints::Absence) override {
      machines.erase(gateway);
    }
    void on_channel(const ChannelStatus& channel) override { uuid = channel.uuid; }
    std::set<InstanceId> machines;
    std::string uuid;
  };

  void SetUp() override {
    tool.subscribe_channels();
    status.claimed = earliest_claim + 1h;
    ASSERT_TRUE(sut.publish(status));
    sut.publish(channel);
    ASSERT_TRUE(until([&] {
      sut.assert_machines();
      return channels.uuid == "first" && channels.machines.contains(status.gateway);
    }));
  }
  void publish_next() {
    later = status;
    later.gateway = InstanceId::random();
    later.claimed = status.claimed + 1h;
    channel.uuid = "next";
    ASSERT_TRUE(next.publish(later));
    next.publish(channel);
  }

  Channels channels;
  endpoints::GatewayMonitor tool{here, context.get_executor(), channels,
                                 endpoints::GatewayMonitor::Of::all};
  ChannelStatus channel{.key = {"cnc", 1}, .uuid = "first"};
  dds::Participant elsewhere{with_lease(processes.there(), long_lease)};
  RecordingGateway also_unused;
  endpoints::CallEndpoint next{elsewhere, context.get_executor(), also_unused};
  MachineStatus later;
};

// Its process still runs, and DDS still knows it: only its liveliness is lost.
TEST_F(AMonitoredGatewayWithChannels, LeavesThemToTheNextOneWhenItIsSilent) {
  ASSERT_TRUE(until([&] { return channels.machines.empty(); }));
  publish_next();
  EXPECT_TRUE(until([&] { return channels.uuid == "next"; }));
}

// A regression: a tool went on showing the state of the silent one until the next change.
TEST_F(AMonitoredGatewayWithChannels, LeavesThemToAnotherOneThatHasPublishedThemBefore) {
  publish_next();
  ASSERT_TRUE(until([&] {
    sut.assert_machines();
    return channels.machines.contains(later.gateway);
  }));
  EXPECT_TRUE(until([&] { return channels.uuid == "next"; }));
  EXPECT_FALSE(channels.machines.contains(status.gateway));
}

TEST_F(AMonitoredGateway, IsSoonGoneForALateReaderToo) {
  ASSERT_TRUE(sut.publish(status));
  ASSERT_TRUE(until_known());
  ASSERT_TRUE(until([&] { return received.machines.empty(); }));
  RecordedMachines later;
  const endpoints::GatewayMonitor other(here, context.get_executor(), later);
  bool known = false;
  EXPECT_TRUE(until([&] {
    known = known || later.machines.contains("cnc");
    return known && later.machines.empty();
  }));
}

// The state of a DDS instance is the same for all its writers, and a sample of the gateway that is
// taken together with it also has that state.
TEST_F(AMonitoredGatewayWithAStranger,
       StaysPresentWhenTheStrangerDisposesItsKeyBetweenTwoOfItsSamples) {
  for (int i = 0; i < 20; ++i) {
    status.since += 1ns;
    ASSERT_TRUE(sut.publish(status));
    stranger.withdraw(status);
    const auto later = std::chrono::steady_clock::now() + 20ms;
    ASSERT_TRUE(until([&] {
      EXPECT_TRUE(received.machines.contains("cnc"));
      return HasFailure() || std::chrono::steady_clock::now() > later;
    }));
  }
}

// A claim to fewer channels, or a later one, would hand the other channels to a standby gateway.
TEST_F(AMonitoredGatewayWithAStranger, IsNotChangedByTheStranger) {
  MachineStatus forged = status;
  forged.claims = {99};
  ASSERT_TRUE(stranger.write(forged));
  ASSERT_TRUE(until([&] {
    sut.assert_machines();
    return !received.ignored.empty();
  }));
  EXPECT_THAT(received.ignored.front(),
              testing::HasSubstr("publishes the state of gateway " + status.gateway.to_string()));
  EXPECT_TRUE(received.last.claims.empty());
}

TEST_F(AMonitoredGatewayWithAStranger, IsGoneWhenItIsGoneAlthoughTheStrangerHasDisposedItsKey) {
  stranger.withdraw(status);
  EXPECT_TRUE(until([&] { return received.machines.empty(); }));
}

TEST_F(AMonitoredGatewayWithAStranger, IsGoneWhenItReleasesTheMachine) {
  stranger.withdraw(status);
  sut.unregister(status);
  const auto soon = std::chrono::steady_clock::now() + long_lease / 2;
  EXPECT_TRUE(until([&] {
    sut.assert_machines();
    return received.machines.empty();
  }));
  EXPECT_LT(std::chrono::steady_clock::now(), soon);
}

}  // namespace
}  // namespace millrace::fabric
