#include "gateway/queues/machine_queue.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include "fabric/cases.hpp"

namespace millrace::gateway::queues {

MachineQueue::MachineQueue(const std::string& machine, QueueSettings settings, QueueBook book,
                           QueuesIo& io, QueueOutlet outlet)
    : queue_(machine, std::move(settings), std::move(book)), io_(io), outlet_(std::move(outlet)) {}

void MachineQueue::on_up(std::unique_ptr<QueueLink> link) {
  link_ = std::move(link);
  asking_ = false;
  watched_ = false;
  queue_.on_up(io_.now());
  go_on();
}

void MachineQueue::on_down(const std::string& reason) {
  link_.reset();
  asking_ = false;
  waits_until_.reset();
  queue_.on_down(reason);
  tell();
}

void MachineQueue::change(QueueSettings settings) {
  queue_.change(std::move(settings));
  on_down("the configuration has changed");
}

void MachineQueue::stop() {
  stopped_ = true;
  link_.reset();
}

void MachineQueue::write(const Write& write) {
  queue_.write(write, io_.now());
  tell();
  go_on();
}

void MachineQueue::on_acknowledged() {
  queue_.on_acknowledged();
  tell();
}

void MachineQueue::on_recorded() {
  queue_.on_journalled(io_.now());
  go_on();
}

void MachineQueue::tell() {
  if (stopped_) {
    return;
  }
  const Queue::News news = queue_.take_news();
  if (!news.entries.empty()) {
    outlet_.record(news.entries, news.wait);
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
  if (link_ && !asking_) {
    if (const auto step = queue_.next(io_.now())) {
      ask(*step);
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
  const auto delay = std::max<std::chrono::nanoseconds>(*next - io_.now().steady, {});
  io_.after(delay, [weak = weak_from_this(), number = ++timer_] {
    const auto self = weak.lock();
    if (self && self->timer_ == number && self->waits_until_) {
      self->waits_until_.reset();
      self->go_on();
    }
  });
}

void MachineQueue::ask(const Step& step) {
  asking_ = true;
  link_->ask(step, [weak = weak_from_this()](StepAnswer answer) {
    if (const auto self = weak.lock(); self && !self->stopped_) {
      self->on_answer(std::move(answer));
    }
  });
}

void MachineQueue::on_answer(StepAnswer answer) {
  const Moment now = io_.now();
  std::visit(fabric::Cases{[&](Answer<Control>& control) {
                             queue_.on_control(control, now);
                             if (control && queue_.settings().events && !watched_) {
                               watch();
                             }
                           },
                           [&](Answer<std::vector<std::string>>& texts) {
                             queue_.on_array(std::move(texts), now);
                           },
                           [&](Answer<void>& written) { queue_.on_written(written, now); }},
             answer);
  asking_ = false;
  go_on();
}

/// It makes no difference whether the controller tells: the queue is looked at all the same.
void MachineQueue::watch() {
  watched_ = true;
  link_->watch([weak = weak_from_this()] {
    if (const auto self = weak.lock(); self && !self->stopped_) {
      self->queue_.on_event(self->io_.now());
      self->go_on();
    }
  });
}

}  // namespace millrace::gateway::queues
