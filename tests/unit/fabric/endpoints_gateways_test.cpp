// Gateways that end, fall silent, replace each other, or serve one channel at the same time.
#include <set>

#include <dds/dds.h>
#include <gmock/gmock.h>

#include "fabric/wire/subscription.hpp"
#include "tests/unit/fabric/endpoints.hpp"

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using tests::run_until;

/// With a short lease, so that DDS soon takes a process for gone.
class SilentEndpoints : public Endpoints {
 protected:
  SilentEndpoints() : Endpoints(std::chrono::milliseconds(500)) {}
};

TEST_F(Endpoints, DoNotWithdrawTheCallsOfAGatewayThatEnds) {
  auto sut = open_gateway();
  const auto service = start_known();
  ASSERT_TRUE(sut->publish(request(1, service->end.identity())));
  ASSERT_TRUE(until([&] { return service->received.requests.size() == 1; }));
  sut.reset();
  gateway = {};

  // Its successor finds the answer that was published in between.
  ASSERT_TRUE(service->end.publish(reply(service->received.requests.front())));
  sut = open_gateway();
  ASSERT_TRUE(until([&] { return gateway.replies.size() == 1; }));
  EXPECT_THAT(service->received.withdrawn, IsEmpty());
}

/// The same call from another gateway.
Request of_epoch(std::uint64_t epoch, Request request) {
  request.call.epoch = epoch;
  return request;
}

// A regression: two gateways that do not hear each other serve one channel; the one that released
// its call withdrew that of the other.
TEST_F(Endpoints, WithdrawNoCallOfAnotherGateway) {
  const auto sut = open_gateway();
  const auto service = start_known();
  dds::Participant elsewhere(processes.here());
  RecordingGateway other_gateway;
  endpoints::CallEndpoint other(elsewhere, context.get_executor(), other_gateway);
  ASSERT_TRUE(until([&] { return !other_gateway.ready.empty(); }));

  const Request of_gateway = request(1, service->end.identity());
  const Request of_other_gateway = of_epoch(8, of_gateway);
  ASSERT_TRUE(sut->publish(of_gateway));
  ASSERT_TRUE(other.publish(of_other_gateway));
  ASSERT_TRUE(until([&] { return service->received.requests.size() == 2; }));
  other.withdraw(key_of(of_other_gateway));
  ASSERT_TRUE(until([&] { return !service->received.withdrawn.empty(); }));
  EXPECT_THAT(service->received.withdrawn, ElementsAre(key_of(of_other_gateway)));
}

TEST_F(Endpoints, KeepTheRequestsOfTwoGatewaysApart) {
  const auto sut = open_gateway();
  RecordingGateway other_gateway;
  endpoints::CallEndpoint other(here, context.get_executor(), other_gateway);
  // All samples have arrived before the first is taken, as in DoNotRunAWithdrawnCall….
  boost::asio::io_context asleep;
  Instance service(here, asleep, identity());
  ASSERT_TRUE(until_ready(service.end.identity()));
  ASSERT_TRUE(until([&] { return !other_gateway.ready.empty(); }));

  const Request of_gateway = request(1, service.end.identity());
  const Request of_other_gateway = of_epoch(8, of_gateway);
  const Request withdrawn = of_epoch(9, of_gateway);
  ASSERT_TRUE(sut->publish(of_gateway));
  ASSERT_TRUE(other.publish(of_other_gateway));
  ASSERT_TRUE(other.publish(withdrawn));
  other.withdraw(key_of(withdrawn));
  ASSERT_TRUE(run_until(asleep, [&] {
    return service.received.requests.size() == 2 && !service.received.withdrawn.empty();
  }));
  EXPECT_EQ(service.received.requests[0].call, of_gateway.call);
  EXPECT_EQ(service.received.requests[1].call, of_other_gateway.call);
  EXPECT_THAT(service.received.withdrawn, ElementsAre(key_of(withdrawn)));
}

TEST_F(Endpoints, KeepTheAnswersToTwoGatewaysApart) {
  const auto service = start(identity());
  const Request first = request(1, service->end.identity());
  ASSERT_TRUE(service->end.publish(reply(first)));
  ASSERT_TRUE(service->end.publish(reply(of_epoch(8, first))));
  ASSERT_TRUE(service->end.publish(reply(request(2, service->end.identity()))));
  const auto sut = open_gateway();
  ASSERT_TRUE(until([&] { return gateway.replies.size() == 2; }));
  std::set<CallId> calls;
  for (const Reply& reply : gateway.replies) {
    calls.insert(reply.call);
  }
  EXPECT_THAT(calls, ElementsAre(CallId{7, 2}, CallId{8, 1}));
}

/// An observer with a context of its own, so that it reads while the gateway's executor stands
/// still.
class ObservedEndpoints : public Endpoints {
 protected:
  bool until_observed(const CallId& call) {
    return run_until(of_observer, [&] { return observed == call; });
  }

  boost::asio::io_context of_observer;
  CallId observed{};
  wire::Subscription<ChannelStatus> channels{
      there, of_observer.get_executor(), "millrace",
      [this](const wire::Taken<ChannelStatus>& taken) { observed = taken.value.call; }};
};

// If the gateway is killed when the instance has the call, the one that stands by must not take the
// call for a new one.
TEST_F(ObservedEndpoints, PublishTheStatusOfAChannelBeforeItsAtMostOnceRequest) {
  const auto sut = open_gateway();
  InstanceIdentity careful = identity();
  careful.delivery = Delivery::at_most_once;
  const auto service = start(careful);
  ASSERT_TRUE(until_ready(careful));
  ASSERT_TRUE(until([&] { return gateway.channels_read; }));
  // The next status has to wait, since this one was written just now.
  sut->publish(ChannelStatus{.key = {"cnc", 1}, .call = {7, 1}});
  ASSERT_TRUE(until([&] {
    of_observer.restart();
    of_observer.poll();
    return observed == CallId{7, 1};
  }));

  const Request sent = request(2, careful);
  sut->publish(ChannelStatus{.key = sent.key, .call = sent.call});
  ASSERT_TRUE(sut->publish(sent));
  EXPECT_TRUE(until_observed(sent.call));
}

TEST_F(Endpoints, NotifyAServiceThatAGatewayIsGone) {
  auto sut = open_gateway();
  const auto service = start_known();
  const Request sent = deliver(*sut, *service, 1);
  sut.reset();
  ASSERT_TRUE(until([&] { return !service->received.orphaned.empty(); }));
  EXPECT_THAT(service->received.orphaned, ElementsAre(key_of(sent)));
  EXPECT_THAT(service->received.withdrawn, IsEmpty());
}

TEST_F(SilentEndpoints, NotifyAServiceThatAGatewayFellSilentAndRequestsAgain) {
  const auto sut = open_gateway();
  const auto service = start_known();
  const Request sent = deliver(*sut, *service, 1);
  ASSERT_EQ(dds_domain_set_deafmute(here.handle(), true, true, DDS_INFINITY), DDS_RETCODE_OK);
  ASSERT_TRUE(until([&] { return !service->received.orphaned.empty(); }));
  EXPECT_THAT(service->received.orphaned, ElementsAre(key_of(sent)));

  ASSERT_EQ(dds_domain_set_deafmute(here.handle(), false, false, DDS_INFINITY), DDS_RETCODE_OK);
  ASSERT_TRUE(until([&] { return service->received.requests.size() == 2; }));
  EXPECT_EQ(service->received.requests.back().call, sent.call);
}

}  // namespace
}  // namespace millrace::fabric
