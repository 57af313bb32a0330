#include "tests/simulation/gateway/ring_link.hpp"

#include <utility>

namespace millrace::tests::simulation {

namespace queues = gateway::queues;

RingLink::RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link,
                   MessageRing& ring, std::function<void()> begin, Random random)
    : process_(process),
      link_(std::move(link)),
      ring_(ring),
      begin_(std::move(begin)),
      random_(random),
      late_(random_.mostly(1ms, 20ms, 500ms, 20)),
      lost_(static_cast<unsigned>(random_.below(30))) {
  ring_.connected(gateway);
}

RingLink::~RingLink() {
  ring_.watchers.erase(this);
}

void RingLink::ask(const queues::Step& step, std::function<void(queues::StepAnswer)> answered) {
  auto wanted = [this, alive = std::weak_ptr(life_),
                 answered = std::move(answered)](queues::StepAnswer answer) {
    if (const auto begin = alive.expired() ? nullptr : begin_) {
      begin();
    }
    if (!alive.expired()) {
      answered(std::move(answer));
    }
  };
  if (const auto link = link_.lock()) {
    link->ask(ring_, step, std::move(wanted));
  }
}

void RingLink::watch(std::function<void()> told) {
  ring_.watchers[this] = [this, told = std::move(told)] {
    if (random_.chance(lost_)) {
      return;
    }
    process_.after(random_.between(Time{}, late_), [this, alive = std::weak_ptr(life_), told] {
      if (const auto begin = alive.expired() ? nullptr : begin_) {
        begin();
      }
      if (!alive.expired()) {
        told();
      }
    });
  };
}

}  // namespace millrace::tests::simulation
