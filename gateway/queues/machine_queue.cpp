#include "gateway/queues/machine_queue.hpp"

#include <utility>
#include <variant>

#include "fabric/cases.hpp"

namespace millrace::gateway::queues {

MachineQueue::MachineQueue(const std::string& machine, QueueSettings settings, QueueBook book,
                           QueuesIo& io, QueueOutlet outlet)
    : machine_(machine),
      queue_(machine, std::move(settings), std::move(book)),
      io_(io),
      outlet_(std::move(outlet)) {}

void MachineQueue::on_up() {
  up_ = true;
  io_.open(machine_, queue_.settings());
  asking_ = false;
  watched_ = false;
  queue_.on_up(io_.now());
  go_on();
}

void MachineQueue::on_down(const std::string& reason) {
  up_ = false;
  asking_ = false;
  queue_.on_down(reason);
  tell();
}

void MachineQueue::change(QueueSettings settings) {
  queue_.change(std::move(settings));
  on_down("the configuration has changed");
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
  if (up_ && !asking_) {
    if (const auto step = queue_.next(io_.now())) {
      asking_ = true;
      io_.ask(machine_, queue_.key(), *step);
    }
  }
  tell();
}

void MachineQueue::on_time() {
  const auto time = next_time();
  if (time && *time <= io_.now().steady) {
    go_on();
  }
}

std::optional<SteadyTime> MachineQueue::next_time() const {
  return up_ && !asking_ ? queue_.next_time() : std::nullopt;
}

void MachineQueue::on_answer(StepAnswer answer) {
  if (!asking_) {
    return;
  }
  const Moment now = io_.now();
  std::visit(fabric::Cases{[&](Answer<Control>& control) {
                             queue_.on_control(control, now);
                             if (control && queue_.settings().events && !watched_) {
                               // The queue is looked at all the same, whatever the controller
                               // tells.
                               watched_ = true;
                               io_.watch(machine_, queue_.key());
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

void MachineQueue::on_event() {
  if (up_) {
    queue_.on_event(io_.now());
    go_on();
  }
}

}  // namespace millrace::gateway::queues
