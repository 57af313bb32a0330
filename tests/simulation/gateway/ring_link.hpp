// The link from a gateway to a message queue, over the connection to its controller.
#pragma once

#include <memory>

#include "gateway/machines/controller.hpp"
#include "tests/simulation/gateway/ads_link.hpp"

namespace millrace::tests::simulation {

class RingLink {
 public:
  /// `events` outlives it.
  RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link, MessageRing& ring,
           Key queue, gateway::machines::ControllerEvents& events, Random random);
  ~RingLink();
  RingLink(const RingLink&) = delete;
  RingLink& operator=(const RingLink&) = delete;

  void ask(const gateway::queues::Step& step);
  void watch();

 private:
  Process& process_;
  GatewayNumber gateway_;
  std::weak_ptr<AdsLink> link_;
  MessageRing& ring_;
  Key queue_;
  gateway::machines::ControllerEvents& events_;
  Random random_;
  /// The delay of notifications; some changes are not notified at all.
  Time late_;
  unsigned lost_;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);
};

}  // namespace millrace::tests::simulation
