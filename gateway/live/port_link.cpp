#include "gateway/live/port_link.hpp"

#include <utility>
#include <variant>

#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>

#include "base/program/barrier.hpp"

namespace millrace::gateway::live {

namespace asio = boost::asio;

/// What outlives the link, until the last question is answered.
struct PortLink::Held {
  fabric::ChannelKey queue;
  std::unique_ptr<QueuePort> port;
  queues::QueueLinkEvents& events;
  /// Nobody wants the answer any more.
  bool over = false;
};

PortLink::PortLink(asio::any_io_executor executor, const fabric::ChannelKey& queue,
                   std::unique_ptr<QueuePort> port, queues::QueueLinkEvents& events)
    : executor_(std::move(executor)),
      held_(std::make_shared<Held>(Held{queue, std::move(port), events})) {}

PortLink::~PortLink() {
  held_->over = true;
}

void PortLink::ask(const queues::Step& step) {
  // A connection that is gone answers at once.
  asio::post(executor_, [executor = executor_, held = held_, step] {
    asio::co_spawn(executor, carry_out(held, step), base::program::rethrow_from_loop);
  });
}

void PortLink::watch() {
  asio::co_spawn(executor_, let_tell(held_), base::program::rethrow_from_loop);
}

asio::awaitable<void> PortLink::carry_out(std::shared_ptr<Held> held, queues::Step step) {
  queues::StepAnswer answer;
  if (std::holds_alternative<queues::ReadControl>(step)) {
    answer = co_await held->port->read_control();
  } else if (std::holds_alternative<queues::ReadQueue>(step)) {
    answer = co_await held->port->read_queue();
  } else {
    const std::uint32_t element = std::get<queues::WriteLastGet>(step).element;
    answer = co_await held->port->write_last_get(element);
  }
  if (!held->over) {
    held->events.on_queue_answer(held->queue, std::move(answer));
  }
}

asio::awaitable<void> PortLink::let_tell(std::shared_ptr<Held> held) {
  std::function<void()> told = [weak = std::weak_ptr(held)] {
    if (const auto there = weak.lock(); there && !there->over) {
      there->events.on_queue_event(there->queue);
    }
  };
  co_await held->port->watch(std::move(told));
}

}  // namespace millrace::gateway::live
