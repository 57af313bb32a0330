// The endpoints of a gateway and of services, in two DDS domains of one process.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {

inline const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

inline InstanceIdentity identity(const std::string& uuid = square_root) {
  return {.id = InstanceId::random(), .uuid = uuid, .name = "square_root"};
}

inline Request request(std::uint64_t number, const InstanceIdentity& instance,
                       const ChannelKey& key = {.machine = "cnc", .channel = 1}) {
  return {.key = key,
          .call = {.epoch = 7, .number = number},
          .assigned = instance.id,
          .uuid = instance.uuid,
          .text = "4",
          .state = 1};
}

inline Reply reply(const Request& to) {
  return {.key = to.key, .instance = to.assigned, .call = to.call, .text = "2.000000", .state = 1};
}

/// A gateway `here` and its services `there`, on one domain.
class Endpoints : public testing::Test {
 protected:
  Endpoints() : Endpoints(std::nullopt) {}
  explicit Endpoints(std::optional<std::chrono::milliseconds> participant_lease)
      : here(with(processes.here(), participant_lease)),
        there(with(processes.there(), participant_lease)) {}

  struct Instance {
    Instance(dds::Participant& participant, boost::asio::io_context& context,
             InstanceIdentity own_identity)
        : end(participant, context.get_executor(), std::move(own_identity), received) {}
    RecordingInstance received;
    endpoints::ReplyEndpoint end;
  };

  std::unique_ptr<endpoints::CallEndpoint> open_gateway() {
    return std::make_unique<endpoints::CallEndpoint>(here, context.get_executor(), gateway);
  }
  std::unique_ptr<Instance> start(const InstanceIdentity& who) {
    return std::make_unique<Instance>(there, context, who);
  }
  bool until(const std::function<bool()>& done) { return tests::run_until(context, done); }
  bool until_ready(const InstanceIdentity& who) {
    return until([&] { return gateway.ready.contains(who.id); });
  }
  /// A service that the gateway knows.
  std::unique_ptr<Instance> start_known(const std::string& uuid = square_root) {
    auto service = start(identity(uuid));
    EXPECT_TRUE(until_ready(service->end.identity()));
    return service;
  }
  /// A request that the service has received.
  Request deliver(endpoints::CallEndpoint& sut, const Instance& service, std::uint64_t number) {
    const std::size_t before = service.received.requests.size();
    Request sent = request(number, service.end.identity());
    EXPECT_TRUE(sut.publish(sent));
    EXPECT_TRUE(until([&] { return service.received.requests.size() > before; }));
    return sent;
  }
  /// The two directions are independent; this sample arrives after all that was sent before.
  bool until_probe_arrives(endpoints::CallEndpoint& sut, Instance& instance, std::uint64_t number) {
    const ChannelKey probe{.machine = "probe", .channel = 1};
    EXPECT_TRUE(sut.publish(request(number, instance.end.identity(), probe)));
    return until([&] {
      return !instance.received.requests.empty() && instance.received.requests.back().key == probe;
    });
  }

  static dds::ParticipantOptions with(dds::ParticipantOptions options,
                                      std::optional<std::chrono::milliseconds> participant_lease) {
    options.participant_lease = participant_lease;
    return options;
  }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here;
  dds::Participant there;
  RecordingGateway gateway;
};

}  // namespace millrace::fabric
