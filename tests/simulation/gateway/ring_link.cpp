#include "tests/simulation/gateway/ring_link.hpp"

#include <utility>

namespace millrace::tests::simulation {

namespace queues = gateway::queues;

namespace {

queues::StepAnswer done_by(MessageRing& ring, const queues::Step& step, GatewayNumber gateway) {
  if (std::holds_alternative<queues::ReadControl>(step)) {
    return queues::Answer<queues::Control>(ring.control());
  }
  if (std::holds_alternative<queues::ReadQueue>(step)) {
    return queues::Answer<std::vector<std::string>>(ring.texts());
  }
  ring.write_last_get(std::get<queues::WriteLastGet>(step).element, gateway);
  return queues::Answer<void>();
}

queues::StepAnswer refusal_of(const queues::Step& step, const std::string& reason) {
  if (std::holds_alternative<queues::ReadControl>(step)) {
    return queues::Answer<queues::Control>(tl::unexpected(reason));
  }
  if (std::holds_alternative<queues::ReadQueue>(step)) {
    return queues::Answer<std::vector<std::string>>(tl::unexpected(reason));
  }
  return queues::Answer<void>(tl::unexpected(reason));
}

}  // namespace

RingLink::RingLink(Process& process, GatewayNumber gateway, std::weak_ptr<AdsLink> link,
                   MessageRing& ring, Key queue, gateway::machines::ControllerEvents& events,
                   Random random)
    : process_(process),
      gateway_(gateway),
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
  const auto link = link_.lock();
  if (!link) {
    return;
  }
  struct Found {
    queues::StepAnswer answer;
    MessageRing::Sight sight;
  };
  const auto found = std::make_shared<Found>();
  link->ask({.carry_out =
                 [&ring = ring_, gateway = gateway_, step, found] {
                   found->answer = done_by(ring, step, gateway);
                   found->sight = ring.sight(gateway);
                 },
             .told =
                 [this, &ring = ring_, gateway = gateway_, step, found,
                  alive = std::weak_ptr(life_)](const std::string& failure) {
                   if (!failure.empty()) {
                     found->answer = refusal_of(step, failure);
                   } else if (std::holds_alternative<queues::ReadControl>(step)) {
                     ring.seen(gateway, found->sight);
                   }
                   if (!alive.expired()) {
                     // The event may destroy this object, if the gateway has stood still.
                     events_.on_queue_answer(Key(queue_), std::move(found->answer));
                   }
                 }});
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
