// Samples in the name of others: an observer ignores them and reports their writer.
#include "fabric/observer/observer.hpp"

#include <algorithm>

#include <gmock/gmock.h>

#include "fabric/endpoints/command_endpoint.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/support/unchecked_reply_writer.hpp"
#include "tests/unit/fabric/endpoints.hpp"

namespace millrace::fabric {
namespace {

using namespace std::chrono_literals;

class AnObserver : public Endpoints,
                   public observer::ObserverListener,
                   public endpoints::CommandListener {
 protected:
  void SetUp() override {
    ASSERT_TRUE(until_ready(who));
    ASSERT_TRUE(call_endpoint->publish(machine));
    asked = request(17, who);
    ASSERT_TRUE(call_endpoint->publish(asked));
    ASSERT_TRUE(until([&] {
      return count<MachineStatus>() == 1 && count<observer::InstanceNews>() == 1 &&
             count<Request>() == 1;
    }));
  }

  void on_entry(observer::Entry entry) override { entries.push_back(std::move(entry)); }
  void on_ignored(const std::string& reason) override { ignored.push_back(reason); }
  void on_command(const Command& command) override {
    if (command.instance == who.id) {
      EXPECT_TRUE(outcomes.publish({.responder = who.id, .command = command.id, .detail = "true"}));
    }
  }

  bool until(const std::function<bool()>& done) {
    return tests::run_until(context, [&] {
      if (call_endpoint) {
        call_endpoint->assert_machines();
      }
      return done();
    });
  }
  bool until_ignored(const std::string& words) {
    return until([&] {
      return std::ranges::any_of(
          ignored, [&](const std::string& line) { return line.find(words) != std::string::npos; });
    });
  }
  template <typename Sample>
  [[nodiscard]] std::vector<Sample> all() const {
    std::vector<Sample> found;
    for (const observer::Entry& entry : entries) {
      if (const auto* sample = std::get_if<Sample>(&entry.sample)) {
        found.push_back(*sample);
      }
    }
    return found;
  }
  template <typename Sample>
  [[nodiscard]] std::size_t count() const {
    return all<Sample>().size();
  }

  const InstanceIdentity who = identity();
  const std::string request_partition = wire::request_partition("millrace", who.uuid, who.id);
  MachineStatus machine{.machine = "cnc",
                        .gateway = InstanceId::random(),
                        .claimed = earliest_claim + 2h,
                        .host = "hall",
                        .epoch = 7};
  Request asked;
  dds::Participant elsewhere{processes.there()};
  dds::Participant watching{processes.here()};
  std::unique_ptr<endpoints::CallEndpoint> call_endpoint = open_gateway();
  std::unique_ptr<Instance> service = start(who);
  endpoints::CommandEndpoint outcomes{there, context.get_executor(), *this};
  std::vector<observer::Entry> entries;
  std::vector<std::string> ignored;
  observer::Observer sut{watching, context.get_executor(), *this, observer::Interest::everything};
};

TEST_F(AnObserver, AcceptsAReplyFromItsInstanceOnly) {
  wire::Writer<Reply> stranger(elsewhere, wire::service_partition("millrace", who.uuid),
                               {.user_data = registry::format_instance(who.id)});
  Reply forged = reply(asked);
  forged.text = "forged";
  ASSERT_TRUE(stranger.write(forged));
  EXPECT_TRUE(until_ignored("replies to a call of instance " + who.id.to_string()));

  ASSERT_TRUE(service->end.publish(reply(asked)));
  ASSERT_TRUE(until([&] { return count<Reply>() > 0; }));
  EXPECT_EQ(all<Reply>().front().text, "2.000000");
}

// A regression: the page kept 400 replies of 500 kB.
TEST_F(AnObserver, CutsAReplyThatNoChannelCanTakeAndCountsIt) {
  tests::UncheckedReplyWriter careless(there, wire::service_partition("millrace", who.uuid),
                                       registry::format_instance(who.id));
  Reply answer = reply(asked);
  answer.text = std::string(500'000, 'x');
  ASSERT_TRUE(until([&] {
    careless.write(answer, static_cast<std::uint32_t>(ReplyKind::final));
    return count<Reply>() > 0;
  }));
  EXPECT_EQ(all<Reply>().front().text, std::string(max_text, 'x'));
  EXPECT_GE(sut.counts().shortened, 1U);
  EXPECT_TRUE(until_ignored(" publishes a text of 500000 bytes; 127 are kept"));
}

TEST_F(AnObserver, CutsValuesThatNoControllerHas) {
  wire::Writer<DataSample> careless(there, "millrace");
  const Value large{
      .name = "V.A.TABLE", .type = ValueType::real64, .elements = std::vector<double>(100'000)};
  const DataSample sample{.key = {"cnc", 1}, .group = "axes", .values = {large, large, large}};
  ASSERT_TRUE(until([&] {
    EXPECT_TRUE(careless.write(sample));
    return count<DataSample>() > 0;
  }));
  EXPECT_EQ(all<DataSample>().front().values, std::vector(1, large));
  EXPECT_GE(sut.counts().shortened, 1U);
}

TEST_F(AnObserver, AcceptsAReplyFromTheAssignedInstanceOnly) {
  const auto other = start_known();
  Reply uncalled = reply(asked);
  uncalled.instance = other->end.identity().id;
  ASSERT_TRUE(other->end.publish(uncalled));
  EXPECT_TRUE(until_ignored("replies to a call of instance"));
  EXPECT_EQ(count<Reply>(), 0U);

  Request again = request(17, other->end.identity());
  again.attempt = 2;
  ASSERT_TRUE(call_endpoint->publish(again));
  ASSERT_TRUE(until([&] { return other->received.requests.size() == 1; }));
  ASSERT_TRUE(other->end.publish(uncalled));
  EXPECT_TRUE(until([&] { return count<Reply>() == 1; }));
}

TEST_F(AnObserver, AcceptsAWithdrawalFromTheRequesterOnly) {
  wire::Writer<Request> stranger(elsewhere, request_partition);
  // An observer that finds it after the disposal sees nothing.
  constexpr std::size_t instance_and_observer = 2;
  ASSERT_TRUE(until([&] { return stranger.matched().size() == instance_and_observer; }));
  ASSERT_TRUE(stranger.write(withdrawal_of(key_of(asked))));
  stranger.withdraw(asked);
  EXPECT_TRUE(until_ignored("cancels a call"));
  EXPECT_EQ(count<observer::Withdrawal>(), 0U);

  call_endpoint->withdraw(key_of(asked));
  ASSERT_TRUE(until([&] { return count<observer::Withdrawal>() > 0; }));
  EXPECT_EQ(all<observer::Withdrawal>().front().call, asked.call);
}

/// A tool that calls is not a gateway.
TEST_F(AnObserver, AcceptsAWithdrawalFromTheRequesterOnlyAlsoWhereNoGatewayHasTheEpoch) {
  Request tools = asked;
  tools.key.machine = "tool";
  ASSERT_TRUE(call_endpoint->publish(tools));
  ASSERT_TRUE(until([&] { return count<Request>() == 2; }));
  wire::Writer<Request> stranger(elsewhere, request_partition);
  ASSERT_TRUE(stranger.write(withdrawal_of(key_of(tools))));
  EXPECT_TRUE(until_ignored("cancels a call"));
  EXPECT_EQ(count<observer::Withdrawal>(), 0U);
}

TEST_F(AnObserver, AcceptsRequestsAndEventsOfAnEpochFromItsGatewayOnly) {
  wire::Writer<Request> stranger(elsewhere, request_partition);
  Request forged = asked;
  forged.text = "forged";
  ASSERT_TRUE(stranger.write(forged));
  EXPECT_TRUE(until_ignored("sends a request in the epoch of a gateway"));
  wire::Writer<Event> events(elsewhere, "millrace");
  ASSERT_TRUE(until([&] { return !events.matched().empty(); }));
  ASSERT_TRUE(events.write({.key = asked.key, .call = asked.call, .kind = EventKind::withdrawn}));
  EXPECT_TRUE(until_ignored("publishes a call of a gateway"));
  EXPECT_EQ(count<Request>(), 1U);
  EXPECT_EQ(count<Event>(), 0U);
}

TEST_F(AnObserver, AcceptsAnOutcomeFromTheCommandedProcessOnly) {
  wire::Writer<Command> tool(elsewhere, "millrace");
  wire::Writer<Outcome> stranger(elsewhere, "millrace");
  ASSERT_TRUE(until([&] { return tool.matched().size() >= 2; }));
  const Command command{.id = InstanceId::random(), .kind = CommandKind::ping, .instance = who.id};
  ASSERT_TRUE(stranger.write(
      {.responder = who.id, .command = command.id, .done = true, .detail = "forged"}));
  EXPECT_TRUE(until_ignored("publishes the outcome of a command"));
  ASSERT_TRUE(tool.write(command));
  ASSERT_TRUE(until([&] { return count<Outcome>() > 0; }));
  EXPECT_EQ(all<Outcome>().front().detail, "true");
}

TEST_F(AnObserver, AcceptsNoOutcomeFromAnInstanceWithoutACommand) {
  wire::Writer<Command> tool(elsewhere, "millrace");
  ASSERT_TRUE(until([&] { return tool.matched().size() >= 2; }));
  const Command command{.id = InstanceId::random(), .key = asked.key};
  ASSERT_TRUE(tool.write(command));
  ASSERT_TRUE(until([&] { return count<Command>() == 1; }));
  ASSERT_TRUE(outcomes.publish({.responder = who.id, .command = command.id}));
  EXPECT_TRUE(until_ignored("publishes the outcome of a command"));
  EXPECT_EQ(count<Outcome>(), 0U);
}

TEST_F(AnObserver, AcceptsAStateOfAMachineOrAChannelFromItsGatewayOnly) {
  call_endpoint->publish(ChannelStatus{.key = asked.key, .calls = 1});
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() == 1; }));
  wire::Writer<ChannelStatus> channels(elsewhere, "millrace");
  wire::Writer<MachineStatus> machines(elsewhere, "millrace");
  ASSERT_TRUE(channels.write({.key = asked.key, .reason = "forged"}));
  EXPECT_TRUE(until_ignored("tells of cnc/1"));
  MachineStatus forged = machine;
  forged.reason = "forged";
  ASSERT_TRUE(machines.write(forged));
  EXPECT_TRUE(until_ignored("publishes the state of gateway"));
  channels.withdraw({.key = asked.key});
  machines.withdraw(machine);
  call_endpoint->publish(ChannelStatus{.key = asked.key, .calls = 2});
  machine.connected = true;
  ASSERT_TRUE(call_endpoint->publish(machine));
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() > 1 && count<MachineStatus>() > 1; }));
  EXPECT_EQ(all<ChannelStatus>()[1].calls, 2U);
  EXPECT_TRUE(all<MachineStatus>()[1].connected);
}

/// An earlier sample of a stranger no longer counts once the gateway is known to claim the machine,
/// and a second gateway counts once the first one is gone.
TEST_F(AnObserver, AcceptsAChannelFromItsFirstOwner) {
  wire::Writer<ChannelStatus> stranger(elsewhere, "millrace");
  const ChannelKey second{"cnc", 2};
  ASSERT_TRUE(stranger.write({.key = second, .reason = "forged"}));
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() == 1; }));
  call_endpoint->publish(ChannelStatus{.key = second, .calls = 1});
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() == 2; }));
  EXPECT_EQ(all<ChannelStatus>().back().calls, 1U);

  dds::Participant standby(processes.there());
  wire::Writer<MachineStatus> claim(standby, "millrace");
  wire::Writer<ChannelStatus> successor(standby, "millrace");
  ASSERT_TRUE(claim.write({.machine = "cnc",
                           .gateway = InstanceId::random(),
                           .claimed = earliest_claim + 3h,
                           .host = "hall",
                           .epoch = 8}));
  ASSERT_TRUE(successor.write({.key = second, .calls = 3}));
  EXPECT_TRUE(until_ignored("tells of cnc/2"));
  EXPECT_EQ(count<ChannelStatus>(), 2U);
  // Its claim may arrive after its channel.
  ASSERT_TRUE(until([&] { return count<MachineStatus>() == 2; }));
  call_endpoint.reset();
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() > 2; }));
  EXPECT_EQ(all<ChannelStatus>().back().calls, 3U);
}

/// A gateway that is killed disposes nothing, and the key still has the writer of the next one.
TEST_F(AnObserver, AcceptsAChannelFromTheNextGatewayWhenTheFirstIsKilled) {
  struct Other {
    explicit Other(const dds::ParticipantOptions& options) : participant(options) {}
    dds::Participant participant;
    wire::Writer<MachineStatus> machines{participant, "millrace"};
    wire::Writer<ChannelStatus> channels{participant, "millrace"};
  };
  const ChannelKey key{"mill", 1};
  const auto claim = [&](std::uint32_t calls) {
    auto other = std::make_unique<Other>(processes.there());
    EXPECT_TRUE(other->machines.write({.machine = "mill",
                                       .gateway = InstanceId::random(),
                                       .claimed = earliest_claim + std::chrono::hours(calls),
                                       .host = "hall",
                                       .epoch = 7 + calls}));
    return other;
  };
  const auto claims_are_known = [&](std::ptrdiff_t number) {
    return until([&] {
      return std::ranges::count(all<MachineStatus>(), "mill", &MachineStatus::machine) == number;
    });
  };
  auto first = claim(1);
  ASSERT_TRUE(claims_are_known(1));
  EXPECT_TRUE(first->channels.write({.key = key, .calls = 1}));
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() == 1; }));
  const auto second = claim(2);
  // A channel whose gateway is killed goes to who claims the machine.
  ASSERT_TRUE(claims_are_known(2));
  EXPECT_TRUE(second->channels.write({.key = key, .calls = 2}));
  EXPECT_TRUE(until_ignored("tells of mill/1"));
  first.reset();
  ASSERT_TRUE(until([&] { return count<ChannelStatus>() > 1; }));
  EXPECT_EQ(all<ChannelStatus>().back().calls, 2U);
}

TEST_F(AnObserver, NamesAParticipantThatPublishesMoreThanItAccepts) {
  wire::Writer<Alarm> stranger(elsewhere, "millrace");
  ASSERT_TRUE(until([&] { return !stranger.matched().empty(); }));
  for (std::size_t i = 0; i <= wire::Codec<Alarm>::topic().most_keys; ++i) {
    ASSERT_TRUE(stranger.write({.key = {InstanceId::random(), "flood", std::to_string(i)}}));
  }
  EXPECT_TRUE(until_ignored("DDS instances on millrace/v5/alarm: further ones are dropped"));
}

}  // namespace
}  // namespace millrace::fabric
