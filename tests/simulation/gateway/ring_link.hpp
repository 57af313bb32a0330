// The way from a gateway to a message queue, over the connection to its controller.
#pragma once

#include <memory>

#include "gateway/queues/queue_link.hpp"
#include "tests/simulation/gateway/ads_link.hpp"

namespace millrace::tests::simulation {

class RingLink final : public gateway::queues::QueueLink {
 public:
  /// `begin` comes before each answer, and may end this.
  RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link, MessageRing& ring,
           std::function<void()> begin, Random random);
  ~RingLink() override;
  RingLink(const RingLink&) = delete;
  RingLink& operator=(const RingLink&) = delete;

  void ask(const gateway::queues::Step& step,
           std::function<void(gateway::queues::StepAnswer)> answered) override;
  void watch(std::function<void()> told) override;

 private:
  Process& process_;
  std::weak_ptr<AdsLink> link_;
  MessageRing& ring_;
  std::function<void()> begin_;
  Random random_;
  /// How late the controller tells; some changes it does not tell at all.
  Time late_;
  unsigned lost_;
  std::shared_ptr<int> life_ = std::make_shared<int>(0);
};

}  // namespace millrace::tests::simulation
