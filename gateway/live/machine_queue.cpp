#include "gateway/live/machine_queue.hpp"

#include <utility>
#include <variant>

#include <boost/asio/co_spawn.hpp>

#include "base/program/barrier.hpp"

namespace millrace::gateway::live {

namespace asio = boost::asio;

MachineQueue::MachineQueue(asio::any_io_executor executor, const std::string& machine,
                           queues::QueueSettings settings, QueueBook book,
                           std::function<Moment()> now, QueueOutlet outlet)
    : executor_(std::move(executor)),
      queue_(machine, std::move(settings), std::move(book)),
      now_(std::move(now)),
      outlet_(std::move(outlet)),
      timer_(executor_) {}

void MachineQueue::on_up(std::unique_ptr<QueuePort> port) {
  port_ = std::move(port);
  asking_ = false;
  watched_ = false;
  queue_.on_up(now_());
  go_on();
}

void MachineQueue::on_down(const std::string& reason) {
  port_.reset();
  asking_ = false;
  timer_.cancel();
  waits_until_.reset();
  queue_.on_down(reason);
  tell();
}

void MachineQueue::stop() {
  stopped_ = true;
  port_.reset();
  timer_.cancel();
}

void MachineQueue::write(Variable variable, const Value& value) {
  queue_.write(variable, value, now_());
  tell();
  go_on();
}

void MachineQueue::on_acknowledged() {
  queue_.on_acknowledged();
  tell();
}

void MachineQueue::tell() {
  if (stopped_) {
    return;
  }
  const queues::Queue::News news = queue_.take_news();
  if (!news.entries.empty()) {
    std::function<void()> recorded;
    if (news.wait) {
      recorded = [weak = weak_from_this()] {
        if (const auto self = weak.lock(); self && !self->stopped_) {
          self->outlet_.begin();
          self->queue_.on_journalled(self->now_());
          self->go_on();
        }
      };
    }
    outlet_.record(news.entries, std::move(recorded));
  }
  outlet_.tell(news);
  if (news.shows) {
    outlet_.shows();
  }
}

void MachineQueue::go_on() {
  if (stopped_) {
    return;
  }
  if (port_ && !asking_) {
    if (auto step = queue_.next(now_())) {
      asking_ = true;
      asio::co_spawn(executor_, carry_out(shared_from_this(), port_, *step),
                     base::program::rethrow_from_loop);
    } else {
      wait();
    }
  }
  tell();
}

void MachineQueue::wait() {
  const auto next = queue_.next_time();
  if (!next || waits_until_ == next) {
    return;
  }
  waits_until_ = next;
  timer_.expires_at(*next);
  timer_.async_wait([weak = weak_from_this()](boost::system::error_code error) {
    if (const auto self = weak.lock(); self && !error) {
      self->waits_until_.reset();
      self->outlet_.begin();
      self->go_on();
    }
  });
}

asio::awaitable<void> MachineQueue::carry_out(std::shared_ptr<MachineQueue> self,
                                              std::shared_ptr<QueuePort> port, queues::Step step) {
  const auto current = [&] {
    if (!self->stopped_) {
      self->outlet_.begin();
    }
    return !self->stopped_ && self->port_ == port;
  };
  if (std::holds_alternative<queues::ReadControl>(step)) {
    auto control = co_await port->read_control();
    if (!current()) {
      co_return;
    }
    const bool found = control.has_value();
    self->queue_.on_control(control, self->now_());
    if (found && self->queue_.settings().events && !std::exchange(self->watched_, true)) {
      asio::co_spawn(self->executor_, watch(self, port), base::program::rethrow_from_loop);
    }
  } else if (std::holds_alternative<queues::ReadQueue>(step)) {
    auto texts = co_await port->read_queue();
    if (!current()) {
      co_return;
    }
    self->queue_.on_array(std::move(texts), self->now_());
  } else {
    const std::uint32_t element = std::get<queues::WriteLastGet>(step).element;
    const auto written = co_await port->write_last_get(element);
    if (!current()) {
      co_return;
    }
    self->queue_.on_written(written, self->now_());
  }
  self->asking_ = false;
  self->go_on();
}

asio::awaitable<void> MachineQueue::watch(std::shared_ptr<MachineQueue> self,
                                          std::shared_ptr<QueuePort> port) {
  std::function<void()> told = [weak = self->weak_from_this()] {
    if (const auto queue = weak.lock(); queue && !queue->stopped_ && queue->port_) {
      queue->outlet_.begin();
      queue->queue_.on_event(queue->now_());
      queue->go_on();
    }
  };
  // It makes no difference whether the controller tells: the queue is looked at all the same.
  co_await port->watch(std::move(told));
}

}  // namespace millrace::gateway::live
