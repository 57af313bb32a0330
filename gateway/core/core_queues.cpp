// Message queues of controllers: their channels for the call control, and what they say.
#include <span>
#include <utility>

#include <fmt/format.h>

#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

void Core::on_queue_answer(const fabric::ChannelKey& queue, queues::StepAnswer answer) {
  enter();
  queues_.on_answer(queue, std::move(answer));
  finish();
}

void Core::on_queue_event(const fabric::ChannelKey& queue) {
  enter();
  queues_.on_event(queue);
  finish();
}

void Core::open(const std::string& machine, const queues::QueueSettings& queue) {
  if (machines::Link* const link = machines_.link_of(machine)) {
    link->open(queue.key(machine), queue);
  }
}

void Core::ask(const std::string& machine, const fabric::ChannelKey& queue,
               const queues::Step& step) {
  if (machines::Link* const link = machines_.link_of(machine)) {
    link->ask(queue, step);
  }
}

void Core::watch(const std::string& machine, const fabric::ChannelKey& queue) {
  if (machines::Link* const link = machines_.link_of(machine)) {
    link->watch(queue);
  }
}

void Core::on_queue_open(const fabric::ChannelKey& key) {
  control_.on_link_up(key.machine, {key.channel}, now_);
  // Whatever changes there, we do.
  control_.set_told(key, true, now_);
}

void Core::on_queue_down(const fabric::ChannelKey& key, const std::string& reason) {
  control_.on_link_down(key.machine, reason, now_);
}

void Core::on_queue_retired(const fabric::ChannelKey& key) {
  control_.retire(key, now_);
}

void Core::on_queue_read(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  control_.on_read(key, snapshot, now_);
}

void Core::write_queue(const fabric::ChannelKey& key, const Write& write) {
  queues_.write(key, write);
}

void Core::on_queue_write(const fabric::ChannelKey& key) {
  control_.on_write(key, WriteOutcome::written, "", now_);
}

void Core::on_queue_change(const fabric::ChannelKey& key) {
  control_.on_change(key, Variable::request_state, now_);
}

void Core::record_of_queue(const std::vector<JournalEntry>& entries, const Ticket& ticket) {
  for (const JournalEntry& entry : entries) {
    host_.append(entry, &entry == &entries.back() ? ticket : Ticket{});
  }
}

void Core::say_of_queue(const fabric::ChannelKey& key, const queues::Queue::News& news) {
  for (const auto& line : news.lines) {
    host_.say(line.level, fmt::format("{}: {}", key.to_string(), line.text));
  }
  if (news.trouble) {
    host_.notice({.kind = "queue", .subject = key.to_string()}, *news.trouble,
                 "see the names in gateway.textproto, and whether a program has initialised it");
  }
  if (news.filling) {
    host_.notice({.kind = "queue_filling", .subject = key.to_string()}, *news.filling,
                 "start its service, or see why it does not answer");
  }
}

void Core::tell_queue(const fabric::DataSample& sample) {
  sample.values.empty() ? fabric_.dispose(sample) : fabric_.publish(sample);
}

}  // namespace millrace::gateway::core
