#include "tests/simulation/gateway/ring_link.hpp"

#include <utility>

namespace millrace::tests::simulation {

namespace queues = gateway::queues;

RingLink::RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link,
                   MessageRing& ring, Key queue, queues::QueueLinkEvents& events, Random random)
    : process_(process),
      link_(std::move(link)),
      ring_(ring),
      queue_(std::move(queue)),
      events_(events),
      random_(random),
      late_(random_.mostly(1ms, 20ms, 500ms, 20)),
      lost_(static_cast<unsigned>(random_.below(30))) {
  ring_.connected(gateway);
}

RingLink::~RingLink() {
  ring_.watchers.erase(this);
}

void RingLink::ask(const queues::Step& step) {
  if (const auto link = link_.lock()) {
    link->ask(ring_, step, [this, alive = std::weak_ptr(life_)](queues::StepAnswer answer) {
      if (!alive.expired()) {
        // This may end with the event: where the gateway has stood still.
        events_.on_queue_answer(Key(queue_), std::move(answer));
      }
    });
  }
}

void RingLink::watch() {
  ring_.watchers[this] = [this] {
    if (!random_.chance(lost_)) {
      process_.after(random_.between(Time{}, late_), [this, alive = std::weak_ptr(life_)] {
        if (!alive.expired()) {
          events_.on_queue_event(Key(queue_));
        }
      });
    }
  };
}

}  // namespace millrace::tests::simulation
