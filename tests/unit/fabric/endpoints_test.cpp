#include "tests/unit/fabric/endpoints.hpp"

#include <atomic>
#include <optional>
#include <set>

#include <gmock/gmock.h>

#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "tests/bench/process_use.hpp"

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using tests::run_until;
constexpr endpoints::Receiving directly = endpoints::Receiving::directly;

TEST_F(Endpoints, CarryACallAndItsAnswer) {
  const auto sut = open_gateway();
  const auto service = start_known();
  EXPECT_EQ(gateway.ready.begin()->second, service->end.identity());

  const Request sent = deliver(*sut, *service, 1);
  const Request& delivered = service->received.requests.front();
  EXPECT_EQ(delivered.call, sent.call);
  EXPECT_EQ(delivered.text, "4");
  EXPECT_EQ(delivered.assigned, service->end.identity().id);

  ASSERT_TRUE(service->end.publish(reply(delivered)));
  ASSERT_TRUE(until([&] { return !gateway.replies.empty(); }));
  EXPECT_EQ(gateway.replies.front().text, "2.000000");
  EXPECT_EQ(gateway.replies.front().call, sent.call);
}

TEST_F(Endpoints, CarryCallsThatAreDispatchedTogether) {
  // More than fit into a datagram.
  constexpr std::uint16_t calls = 200;
  const auto sut = open_gateway();
  const auto service = start_known();
  for (std::uint16_t channel = 1; channel <= calls; ++channel) {
    const ChannelKey key{.machine = "cnc", .channel = channel};
    ASSERT_TRUE(sut->publish(request(channel, service->end.identity(), key)));
  }
  ASSERT_TRUE(until([&] { return service->received.requests.size() == calls; }));
  const ChannelKey last{.machine = "cnc", .channel = calls};
  ASSERT_TRUE(sut->publish(request(calls + 1, service->end.identity())));
  sut->withdraw({last, 7, service->end.identity().id});
  EXPECT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
}

/// Records the status of a channel at each change, with `calls` in place of a time.
class Watcher {
 public:
  explicit Watcher(const dds::Participant& participant)
      : reader_(participant, participant.options().fabric, wire::Keep::all) {}
  std::vector<std::uint64_t> take() {
    for (const wire::Taken<ChannelStatus>& taken : reader_.take()) {
      if (taken.valid) {
        seen_.push_back(taken.value.calls);
      }
    }
    return seen_;
  }

 private:
  wire::Reader<ChannelStatus> reader_;
  std::vector<std::uint64_t> seen_;
};

TEST_F(Endpoints, ShowTheCurrentChannelsToALateReader) {
  const ChannelKey key{.machine = "cnc", .channel = 1};
  const auto show = [&](endpoints::CallEndpoint& sut, std::uint64_t calls) {
    sut.publish(ChannelStatus{.key = key, .calls = calls});
  };
  const auto sut = open_gateway();
  show(*sut, 1);
  show(*sut, 2);
  {
    Watcher first(there);
    // A change that was not seen in time is not delivered later.
    ASSERT_TRUE(until([&] { return first.take() == std::vector<std::uint64_t>{2}; }));
    // Nor is one that is replaced in the same moment.
    show(*sut, 3);
    show(*sut, 4);
    ASSERT_TRUE(until([&] { return first.take() == std::vector<std::uint64_t>{2, 4}; }));
    Watcher second(there);
    ASSERT_TRUE(until([&] { return !second.take().empty(); }));
    EXPECT_EQ(second.take().back(), 4U);
  }
  show(*sut, 5);
  Watcher third(there);
  ASSERT_TRUE(until([&] { return !third.take().empty() && third.take().back() == 5; }));
}

TEST_F(Endpoints, NotifyAGatewayWhichOfItsTopicsAreRead) {
  const auto sut = open_gateway();
  {
    Watcher watcher(there);
    ASSERT_TRUE(until([&] { return gateway.channels_read; }));
    EXPECT_FALSE(gateway.events_read);
  }
  ASSERT_TRUE(until([&] { return !gateway.channels_read; }));
  const wire::Reader<Event> recorder(there, there.options().fabric, wire::Keep::all);
  ASSERT_TRUE(until([&] { return gateway.events_read; }));
  EXPECT_FALSE(gateway.channels_read);
}

TEST_F(Endpoints, RefuseACallForAnUndiscoveredInstance) {
  const auto sut = open_gateway();
  const auto result = sut->publish(request(1, identity("no-such-service")));
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error(), HasSubstr("was not discovered"));
}

TEST_F(Endpoints, NeverLoseTheReplyOfFreshEndpoints) {
  constexpr int rounds = 200;
  for (int round = 0; round < rounds; ++round) {
    SCOPED_TRACE(round);
    const auto sut = open_gateway();
    const auto service = start(identity());
    ASSERT_TRUE(until_ready(service->end.identity()));
    ASSERT_TRUE(sut->publish(request(1, service->end.identity())));
    ASSERT_TRUE(until([&] { return service->received.requests.size() == 1; }));
    ASSERT_TRUE(service->end.publish(reply(service->received.requests.front())));
    ASSERT_TRUE(until([&] { return gateway.replies.size() == 1; }));
    gateway = {};
  }
}

TEST_F(Endpoints, KeepTwoServicesApart) {
  const auto sut = open_gateway();
  const auto service = start(identity());
  const auto other = start(identity("dial-gauge"));
  ASSERT_TRUE(until_ready(service->end.identity()));
  ASSERT_TRUE(until_ready(other->end.identity()));
  ASSERT_TRUE(sut->publish(request(1, service->end.identity())));
  ASSERT_TRUE(until_probe_arrives(*sut, *service, 2));
  ASSERT_TRUE(until_probe_arrives(*sut, *other, 3));
  EXPECT_EQ(service->received.requests.size(), 2U);
  EXPECT_EQ(other->received.requests.size(), 1U);
}

TEST_F(Endpoints, NotifyARunningServiceOfAWithdrawal) {
  const auto sut = open_gateway();
  const auto service = start_known();
  const Request sent = deliver(*sut, *service, 1);

  sut->withdraw(key_of(sent));
  ASSERT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
  EXPECT_THAT(service->received.withdrawn, ElementsAre(key_of(sent)));
}

TEST_F(Endpoints, DoNotRunAWithdrawnCallThatWasNotReadYet) {
  const auto sut = open_gateway();
  // Within one domain object a write returns when its sample has arrived, and a separate executor
  // keeps the instance from taking it: both samples have arrived before the first is taken.
  boost::asio::io_context asleep;
  Instance service(here, asleep, identity());
  ASSERT_TRUE(until_ready(service.end.identity()));
  const Request sent = request(1, service.end.identity());
  ASSERT_TRUE(sut->publish(sent));
  sut->withdraw(key_of(sent));
  EXPECT_TRUE(run_until(asleep, [&] { return !service.received.withdrawn.empty(); }));
  EXPECT_THAT(service.received.requests, IsEmpty());
}

/// A participant that is not part of the call disposes and unregisters its key.
class AStrangerBesideEndpoints : public Endpoints {
 protected:
  void dispose(const Request& request) {
    stranger.emplace(elsewhere,
                     wire::request_partition("millrace", request.uuid, request.assigned));
    ASSERT_TRUE(until([&] { return !stranger->matched().empty(); }));
    stranger->withdraw(request);
    stranger->unregister(request);
  }

  dds::Participant elsewhere{processes.here()};
  std::optional<wire::Writer<Request>> stranger;
};

TEST_F(AStrangerBesideEndpoints, WithdrawsNoRequestThatItsInstanceHasNotReadYet) {
  const auto sut = open_gateway();
  // As in DoNotRunAWithdrawnCall….
  boost::asio::io_context asleep;
  Instance service(here, asleep, identity());
  ASSERT_TRUE(until_ready(service.end.identity()));
  const Request sent = request(1, service.end.identity());
  ASSERT_TRUE(sut->publish(sent));
  dispose(sent);
  EXPECT_TRUE(run_until(asleep, [&] {
    return !service.received.requests.empty() || !service.received.withdrawn.empty();
  }));
  EXPECT_THAT(service.received.requests, SizeIs(1));
  EXPECT_THAT(service.received.withdrawn, IsEmpty());
}

TEST_F(AStrangerBesideEndpoints, WithdrawsARequestInItsOwnNameOnly) {
  const auto sut = open_gateway();
  const auto service = start_known();
  const Request sent = deliver(*sut, *service, 1);
  dispose(sent);
  ASSERT_TRUE(stranger->write(withdrawal_of(key_of(sent))));
  ASSERT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
  EXPECT_NE(service->received.withdrawn_by.front(), service->received.requests.front().requester);
}

TEST_F(AStrangerBesideEndpoints, HidesNoWithdrawal) {
  const auto sut = open_gateway();
  const auto service = start_known();
  const Request sent = deliver(*sut, *service, 1);
  dispose(sent);
  sut->withdraw(key_of(sent));
  EXPECT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
  EXPECT_THAT(service->received.withdrawn, ElementsAre(key_of(sent)));
}

TEST_F(AStrangerBesideEndpoints, RequestsALimitedNumberOfChannels) {
  constexpr std::size_t most = 4'096;
  const auto service = start(identity());
  const InstanceIdentity& who = service->end.identity();
  stranger.emplace(elsewhere, wire::request_partition("millrace", who.uuid, who.id));
  ASSERT_TRUE(until([&] { return !stranger->matched().empty(); }));
  for (std::uint16_t channel = 1; channel <= most + 64; ++channel) {
    ASSERT_TRUE(stranger->write(request(1, who, {.machine = "cnc", .channel = channel})));
  }
  ASSERT_TRUE(until([&] {
    return service->received.requests.size() >= most && !service->received.ignored.empty();
  }));
  EXPECT_THAT(service->received.requests, SizeIs(most));
  EXPECT_THAT(service->received.ignored,
              ElementsAre(HasSubstr("writes more than 4096 DDS instances on millrace/v5/request")));
}

/// Used by Cyclone's threads while the test checks it.
class RepliesAtOnce : public endpoints::ReplyEndpointListener {
 public:
  void on_request(const Request& request) override {
    if (endpoints::ReplyEndpoint* const to = end) {
      EXPECT_TRUE(to->publish(reply(request)));
    }
  }
  void on_withdrawn(const RequestKey&) override { ++withdrawn; }

  std::atomic<endpoints::ReplyEndpoint*> end = nullptr;
  std::atomic<int> withdrawn = 0;
};

TEST_F(Endpoints, PassACallAndItsWithdrawalToAServiceThatReceivesDirectly) {
  const auto sut = open_gateway();
  const InstanceIdentity who = identity();
  RepliesAtOnce listener;
  endpoints::ReplyEndpoint end(there, context.get_executor(), who, listener, directly);
  listener.end = &end;
  ASSERT_TRUE(until_ready(who));
  for (std::uint64_t number = 1; number <= 100; ++number) {
    ASSERT_TRUE(sut->publish(request(number, who)));
    ASSERT_TRUE(until([&] { return gateway.replies.size() == number; })) << number;
  }
  sut->withdraw(key_of(request(100, who)));
  EXPECT_TRUE(until([&] { return listener.withdrawn > 0; }));
}

// The executor sends the last replies of such a burst.
TEST_F(Endpoints, CarryTheRepliesToRequestsThatComeTogether) {
  const auto sut = open_gateway();
  const InstanceIdentity who = identity();
  RepliesAtOnce listener;
  endpoints::ReplyEndpoint end(there, context.get_executor(), who, listener, directly);
  listener.end = &end;
  ASSERT_TRUE(until_ready(who));
  constexpr std::size_t most = 100;
  for (std::size_t burst = 1; burst <= most; ++burst) {
    for (std::size_t channel = 1; channel <= burst; ++channel) {
      ASSERT_TRUE(sut->publish(
          request(burst, who, {.machine = "cnc", .channel = static_cast<std::uint16_t>(channel)})));
    }
    ASSERT_TRUE(until([&] { return gateway.replies.size() == burst; })) << burst;
    gateway.replies.clear();
  }
}

// The receiving thread may be in the listener at that moment.
TEST_F(Endpoints, LetAServiceThatReceivesDirectlyLeaveWhileRequestsArrive) {
  const auto sut = open_gateway();
  for (std::uint64_t round = 0; round < 20; ++round) {
    const InstanceIdentity who = identity();
    RepliesAtOnce listener;
    auto end = std::make_unique<endpoints::ReplyEndpoint>(there, context.get_executor(), who,
                                                          listener, directly);
    listener.end = end.get();
    ASSERT_TRUE(until_ready(who));
    for (std::uint64_t number = 1; number <= 50; ++number) {
      ASSERT_TRUE(sut->publish(request(100 * round + number, who)));
    }
    end.reset();
    ASSERT_TRUE(until([&] { return !gateway.ready.contains(who.id); }));
  }
}

TEST_F(Endpoints, LetAChannelCallAgainAfterAWithdrawal) {
  const auto sut = open_gateway();
  const auto service = start_known();
  for (std::uint64_t number = 1; number <= 20; ++number) {
    const Request sent = request(number, service->end.identity());
    ASSERT_TRUE(sut->publish(sent));
    ASSERT_TRUE(until([&] {
      return !service->received.requests.empty() &&
             service->received.requests.back().call == sent.call;
    }));
    sut->withdraw(key_of(sent));
  }
}

TEST_F(Endpoints, KeepNoMemoryOfWithdrawnRequests) {
  const auto sut = open_gateway();
  const auto service = start(identity());
  ASSERT_TRUE(until_ready(service->end.identity()));
  std::uint64_t number = 0;
  const auto withdraw_requests = [&](int count) {
    for (int i = 0; i < count; ++i) {
      const Request sent = request(++number, service->end.identity());
      ASSERT_TRUE(sut->publish(sent));
      sut->withdraw(key_of(sent));
      ASSERT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
      service->received.requests.clear();
      service->received.withdrawn.clear();
    }
  };
  withdraw_requests(500);
  const double before = bench::resident_mib(::getpid());
  withdraw_requests(5'000);
  const double grown = bench::resident_mib(::getpid()) - before;
  EXPECT_TRUE(bench::keeps_what_is_freed || grown < 2.0) << grown << " MiB more";
}

// A key costs Cyclone's writer memory also when it is forgotten
// (docs/dev/measurements/footprint.md).
TEST_F(Endpoints, KeepTheResponsesOfTheLast1024Callers) {
  const auto service = start(identity());
  const InstanceIdentity& own = service->end.identity();
  std::uint64_t callers = 0;
  const auto answer_callers = [&](std::uint64_t count) {
    for (const std::uint64_t end = callers + count; callers < end;) {
      Request sent = request(1, own);
      sent.call.epoch = ++callers;
      ASSERT_TRUE(service->end.publish(reply(sent)));
    }
  };
  answer_callers(2'000);
  const double before = bench::resident_mib(::getpid());
  answer_callers(10'000);
  const double grown = bench::resident_mib(::getpid()) - before;
  EXPECT_TRUE(bench::keeps_what_is_freed || grown < 10.0) << grown << " MiB more";

  wire::Reader<Reply> late(here, wire::service_partition(here.options().fabric, own.uuid),
                           wire::Keep::all);
  std::set<std::uint64_t> known;
  const auto take = [&] {
    for (const wire::Taken<Reply>& taken : late.take()) {
      if (taken.valid) {
        known.insert(taken.value.call.epoch);
      }
    }
    return known.size() >= 1024;
  };
  ASSERT_TRUE(until(take));
  EXPECT_EQ(*known.begin(), callers - 1023);
}

TEST_F(Endpoints, ReportThatAnInstanceDrains) {
  const auto sut = open_gateway();
  const auto service = start(identity());
  const InstanceId id = service->end.identity().id;
  ASSERT_TRUE(until_ready(service->end.identity()));
  service->end.set_draining(true);
  EXPECT_TRUE(until([&] { return gateway.ready.at(id).draining; }));
  service->end.set_draining(false);
  EXPECT_TRUE(until([&] { return !gateway.ready.at(id).draining; }));
}

TEST_F(Endpoints, ReportThatAnInstanceLeft) {
  const auto sut = open_gateway();
  auto service = start(identity());
  ASSERT_TRUE(until_ready(service->end.identity()));
  service.reset();
  EXPECT_TRUE(until([&] { return gateway.ready.empty() && gateway.gone == 1; }));
}

TEST_F(Endpoints, RefuseWhatDoesNotFit) {
  const auto sut = open_gateway();
  const auto service = start_known();
  Request long_text = request(1, service->end.identity());
  long_text.text.assign(max_text + 1, 'x');
  EXPECT_EQ(sut->publish(long_text).error(), "the text has 128 bytes, at most 127 fit");

  Reply no_state = reply(request(1, service->end.identity()));
  no_state.state = 0;
  EXPECT_FALSE(service->end.publish(no_state));
  no_state.kind = ReplyKind::interim;
  EXPECT_TRUE(service->end.publish(no_state));
}

TEST_F(Endpoints, MayEndWhileWorkIsPosted) {
  for (int round = 0; round < 50; ++round) {
    auto sut = open_gateway();
    auto service = start(identity());
    context.poll();
    service.reset();
    sut.reset();
    context.restart();
    context.poll();
  }
  EXPECT_EQ(gateway.replies.size(), 0U);
}

TEST_F(Endpoints, RefuseAnInstanceThatCannotBeAnnounced) {
  EXPECT_THROW(start(identity("560AACBF-6335-44a9-895A-8B27F3ED5E47")), std::invalid_argument);
  EXPECT_THROW(start(identity("*")), std::invalid_argument);
  EXPECT_THROW(start(identity("")), std::invalid_argument);
}

}  // namespace
}  // namespace millrace::fabric
