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
  std::unique_ptr<QueuePort> port;
  std::function<void()> begin;
  bool over = false;

  /// False if nobody wants the answer any more.
  [[nodiscard]] bool wanted() const {
    if (!over) {
      begin();
    }
    return !over;
  }
};

PortLink::PortLink(asio::any_io_executor executor, std::unique_ptr<QueuePort> port,
                   std::function<void()> begin)
    : executor_(std::move(executor)),
      held_(std::make_shared<Held>(Held{std::move(port), std::move(begin)})) {}

PortLink::~PortLink() {
  held_->over = true;
}

void PortLink::ask(const queues::Step& step, std::function<void(queues::StepAnswer)> answered) {
  // A connection that is gone answers at once.
  asio::post(executor_, [executor = executor_, held = held_, step, answered = std::move(answered)] {
    asio::co_spawn(executor, carry_out(held, step, answered), base::program::rethrow_from_loop);
  });
}

void PortLink::watch(std::function<void()> told) {
  asio::co_spawn(executor_, let_tell(held_, std::move(told)), base::program::rethrow_from_loop);
}

asio::awaitable<void> PortLink::carry_out(std::shared_ptr<Held> held, queues::Step step,
                                          std::function<void(queues::StepAnswer)> answered) {
  queues::StepAnswer answer;
  if (std::holds_alternative<queues::ReadControl>(step)) {
    answer = co_await held->port->read_control();
  } else if (std::holds_alternative<queues::ReadQueue>(step)) {
    answer = co_await held->port->read_queue();
  } else {
    const std::uint32_t element = std::get<queues::WriteLastGet>(step).element;
    answer = co_await held->port->write_last_get(element);
  }
  if (held->wanted()) {
    answered(std::move(answer));
  }
}

asio::awaitable<void> PortLink::let_tell(std::shared_ptr<Held> held, std::function<void()> told) {
  std::function<void()> told_while_there = [weak = std::weak_ptr(held), told = std::move(told)] {
    if (const auto there = weak.lock(); there && there->wanted()) {
      told();
    }
  };
  co_await held->port->watch(std::move(told_while_there));
}

}  // namespace millrace::gateway::live
