#include "gateway/queues/plant_queues.hpp"

#include <algorithm>
#include <utility>

#include "gateway/queues/queue_sample.hpp"

namespace millrace::gateway::queues {

bool PlantQueues::finish() {
  const bool some = !due_.empty();
  while (!due_.empty()) {
    const std::function<void()> act = std::move(due_.front());
    due_.pop_front();
    act();
  }
  return some;
}

void PlantQueues::on_time() {
  for (auto& [key, one] : queues_) {
    one.queue->on_time();
  }
}

std::optional<SteadyTime> PlantQueues::next_time() const {
  std::optional<SteadyTime> first;
  for (const auto& [key, one] : queues_) {
    const auto time = one.queue->next_time();
    if (time && (!first || *time < *first)) {
      first = time;
    }
  }
  return first;
}

void PlantQueues::begin(const fabric::ChannelKey& key, One& one, QueueBook book) {
  one.number = ++begun_;
  one.queue = std::make_unique<MachineQueue>(
      one.machine, one.settings, std::move(book), io_,
      QueueOutlet{
          .record =
              [this, key, number = one.number](const auto& entries, bool wait) {
                events_.record_of_queue(
                    entries, wait ? Ticket{Ticket::Owner::queue, key, number} : Ticket{});
              },
          .shows = [this, key] { due_.push_back([this, key] { events_.on_queue_change(key); }); },
          .tell = [this, key](const auto& news) { events_.say_of_queue(key, news); }});
}

void PlantQueues::set(const std::map<std::string, std::vector<QueueSettings>>& wanted,
                      const std::map<fabric::ChannelKey, QueueBook>& known) {
  for (auto& [key, one] : queues_) {
    one.leaving = true;
  }
  for (const auto& [machine, all] : wanted) {
    for (const QueueSettings& settings : all) {
      const fabric::ChannelKey key = settings.key(machine);
      const auto [found, is_new] = queues_.try_emplace(key);
      One& one = found->second;
      one.leaving = false;
      if (is_new) {
        one.machine = machine;
        one.settings = settings;
        const auto book = known.find(key);
        begin(key, one, book == known.end() ? QueueBook() : book->second);
      } else if (one.settings != settings) {
        one.settings = settings;
        one.queue->change(settings);
      }
      // Also one that was leaving when its link came up.
      reach(key, one);
      review(key, one);
    }
  }
  for (auto& [key, one] : queues_) {
    if (one.leaving) {
      review(key, one);
    }
  }
}

void PlantQueues::open(const fabric::ChannelKey& key, One& one) {
  one.retired = false;
  due_.push_back([this, key] {
    if (const auto found = queues_.find(key); found != queues_.end() && !found->second.retired) {
      open_now(key, found->second);
    }
  });
}

/// As with a controller's link: what was asked before it went down is answered before it is back.
void PlantQueues::open_now(const fabric::ChannelKey& key, One& one) {
  one.opens = one.asked > 0;
  if (!one.opens) {
    events_.on_queue_open(key);
    queues_.at(key).queue->tell();
  }
}

template <typename Tell>
void PlantQueues::answer(const fabric::ChannelKey& key, Tell tell) {
  One& asked = queues_.at(key);
  ++asked.asked;
  due_.push_back([this, key, number = asked.number, tell = std::move(tell)] {
    const auto found = queues_.find(key);
    // Another one may have taken its place.
    if (found == queues_.end() || found->second.number != number) {
      return;
    }
    --found->second.asked;
    tell(found->second);
    if (const auto still = queues_.find(key);
        still != queues_.end() && still->second.opens && !still->second.retired) {
      open_now(key, still->second);
    }
  });
}

/// Whose calls are there: those of queues that are ours, and those of messages that the journal
/// has.
void PlantQueues::review(const fabric::ChannelKey& key, One& one) {
  const bool messages = one.queue->queue().book().waiting() > 0;
  if (!one.leaving && (one.ours || messages)) {
    open(key, one);
  } else if (!one.retired) {
    one.retired = true;
    due_.push_back([this, key] {
      if (const auto found = queues_.find(key); found != queues_.end() && found->second.retired) {
        events_.on_queue_retired(key);
      }
    });
  }
}

void PlantQueues::on_up(const std::string& machine, const std::vector<std::uint16_t>& channels) {
  Reach& way = machines_[machine];
  way.channels.insert(channels.begin(), channels.end());
  way.up = true;
  for (auto& [key, one] : queues_) {
    if (one.machine == machine) {
      reach(key, one);
    }
  }
}

/// Reads the queue if its channel is ours and the link is up.
void PlantQueues::reach(const fabric::ChannelKey& key, One& one) {
  const Reach& way = machines_[one.machine];
  if (one.leaving || !way.up || !way.channels.contains(one.settings.channel)) {
    return;
  }
  one.ours = true;
  open(key, one);
  if (!one.queue->up()) {
    one.queue->on_up();
  }
}

void PlantQueues::on_down(const std::string& machine, const std::string& reason) {
  machines_[machine].up = false;
  for (auto& [key, one] : queues_) {
    if (one.machine != machine) {
      continue;
    }
    one.queue->on_down(reason);
    if (one.queue->queue().book().waiting() == 0 && one.ours) {
      due_.push_back([this, key = key, reason] {
        if (const auto found = queues_.find(key); found != queues_.end()) {
          found->second.opens = false;
          events_.on_queue_down(key, reason);
        }
      });
    }
  }
}

void PlantQueues::on_left(const std::string& machine, std::uint16_t channel,
                          const std::string& reason) {
  auto& channels = machines_[machine].channels;
  channel == 0 ? channels.clear() : static_cast<void>(channels.erase(channel));
  for (auto& [key, one] : queues_) {
    if (one.machine == machine && (channel == 0 || one.settings.channel == channel)) {
      one.ours = false;
      one.queue->on_down(reason);
      review(key, one);
    }
  }
}

void PlantQueues::on_over(const fabric::ChannelKey& key) {
  const auto found = queues_.find(key);
  if (found != queues_.end() && found->second.leaving) {
    if (!found->second.told.values.empty()) {
      fabric::DataSample gone = found->second.told;
      gone.values.clear();
      events_.tell_queue(gone);
    }
    queues_.erase(found);
  }
}

void PlantQueues::read(const fabric::ChannelKey& key, ReadSet look) {
  if (queues_.contains(key)) {
    answer(key, [this, key, look](const One& one) {
      const Snapshot shown = one.queue->look(look);
      one.queue->on_read(look);
      events_.on_queue_read(key, shown);
    });
  }
}

void PlantQueues::write(const fabric::ChannelKey& key, const Write& write) {
  const auto found = queues_.find(key);
  if (found == queues_.end()) {
    return;
  }
  found->second.queue->write(write);
  answer(key, [this, key](const One&) {
    events_.on_queue_write(key);
    // The end of the call may have ended the queue.
    if (const auto still = queues_.find(key); still != queues_.end()) {
      still->second.queue->on_acknowledged();
      if (!still->second.ours && still->second.queue->queue().book().waiting() == 0) {
        review(key, still->second);
      }
    }
  });
}

void PlantQueues::on_recorded(const Ticket& ticket) {
  // Another one may have taken its place.
  if (const auto found = queues_.find(ticket.key);
      found != queues_.end() && found->second.number == ticket.number) {
    found->second.queue->on_recorded();
  }
}

void PlantQueues::on_answer(const fabric::ChannelKey& key, StepAnswer answer) {
  if (const auto found = queues_.find(key); found != queues_.end()) {
    found->second.queue->on_answer(std::move(answer));
  }
}

void PlantQueues::on_event(const fabric::ChannelKey& key) {
  if (const auto found = queues_.find(key); found != queues_.end()) {
    found->second.queue->on_event();
  }
}

void PlantQueues::tell_numbers() {
  for (auto& [key, one] : queues_) {
    tell_numbers(key, one);
  }
}

void PlantQueues::tell_numbers(const fabric::ChannelKey& key, One& one) {
  if (!one.ours && one.queue->queue().book().waiting() == 0) {
    return;
  }
  fabric::DataSample sample =
      sample_of(key, one.settings, one.queue->queue().view(), io_.now().wall);
  const auto same = [](const fabric::Value& a, const fabric::Value& b) {
    return a.name == b.name && a.elements == b.elements && a.quality == b.quality;
  };
  if (std::ranges::equal(sample.values, one.told.values, same)) {
    return;
  }
  one.told = sample;
  events_.tell_queue(sample);
}

}  // namespace millrace::gateway::queues
