#include "gateway/core/message_queues.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "gateway/queues/message_queue.hpp"

namespace millrace::gateway::core {

void MessageQueues::set(const std::map<std::string, std::vector<queues::QueueSettings>>& wanted,
                        const std::map<fabric::ChannelKey, QueueLog>& known, Moment now) {
  for (auto& [key, one] : queues_) {
    one.removed = true;
  }
  for (const auto& [machine, all] : wanted) {
    for (const queues::QueueSettings& settings : all) {
      const fabric::ChannelKey key = settings.key(machine);
      One* one = find(key);
      if (one == nullptr) {
        const auto queue_log = known.find(key);
        one = &queues_
                   .try_emplace(key, machine, settings,
                                queue_log == known.end() ? QueueLog() : queue_log->second)
                   .first->second;
        one->number = ++begun_;
      } else if (one->queue.settings() != settings) {
        one->queue.change(settings);
        go_down(*one, base::messages::configuration_changed());
      }
      one->removed = false;
      // Also one that was leaving when its link came up.
      reach(key, *one, now);
      review(key, *one);
    }
  }
  for (auto& [key, one] : queues_) {
    if (one.removed) {
      review(key, one);
    }
  }
}

MessageQueues::One* MessageQueues::find(const fabric::ChannelKey& key) {
  const auto found = queues_.find(key);
  return found == queues_.end() ? nullptr : &found->second;
}

/// Whether its calls exist: those of queues that are ours, and those of messages in the journal.
void MessageQueues::review(const fabric::ChannelKey& key, One& one) {
  if (!one.removed && (one.ours || one.has_messages())) {
    open(key, one);
  } else if (!one.draining) {
    one.draining = true;
    events_.push_back({.kind = Kind::draining, .key = key, .number = one.number});
  }
}

void MessageQueues::open(const fabric::ChannelKey& key, One& one) {
  one.draining = false;
  events_.push_back({.kind = Kind::opened, .key = key, .number = one.number});
}

/// Reads the queue if its channel is ours and the link is up.
void MessageQueues::reach(const fabric::ChannelKey& key, One& one, Moment now) {
  const Reach& way = machines_[one.machine];
  if (one.removed || way.link == nullptr || !way.channels.contains(one.queue.settings().channel)) {
    return;
  }
  one.ours = true;
  open(key, one);
  if (one.link == nullptr) {
    one.link = way.link;
    one.link->open(key, one.queue.settings());
    one.asking = false;
    one.subscribed = false;
    one.queue.on_up(now);
    ask_next(one, now);
  }
}

void MessageQueues::on_up(const std::string& machine, const machines::Channels& channels,
                          machines::Controller& link, Moment now) {
  Reach& way = machines_[machine];
  way.channels.insert(channels.begin(), channels.end());
  way.link = &link;
  for (auto& [key, one] : queues_) {
    if (one.machine == machine) {
      reach(key, one, now);
    }
  }
}

void MessageQueues::go_down(One& one, const fabric::Message& reason) {
  one.link = nullptr;
  one.asking = false;
  one.queue.on_down(reason);
  take_output(one);
}

void MessageQueues::on_down(const std::string& machine, const fabric::Message& reason) {
  machines_[machine].link = nullptr;
  for (auto& [key, one] : queues_) {
    if (one.machine != machine) {
      continue;
    }
    go_down(one, reason);
    if (!one.has_messages() && one.ours) {
      events_.push_back({.kind = Kind::down, .key = key, .reason = reason, .number = one.number});
    }
  }
}

void MessageQueues::lose_channel(const fabric::ChannelKey& key, One& one,
                                 const fabric::Message& reason) {
  one.ours = false;
  go_down(one, reason);
  review(key, one);
}

void MessageQueues::on_channel_lost(const std::string& machine, std::uint16_t channel,
                                    const fabric::Message& reason) {
  machines_[machine].channels.erase(channel);
  for (auto& [key, one] : queues_) {
    if (one.machine == machine && one.queue.settings().channel == channel) {
      lose_channel(key, one, reason);
    }
  }
}

void MessageQueues::on_link_gone(const std::string& machine, const fabric::Message& reason) {
  machines_.erase(machine);
  for (auto& [key, one] : queues_) {
    if (one.machine == machine) {
      lose_channel(key, one, reason);
    }
  }
}

void MessageQueues::on_over(const fabric::ChannelKey& key) {
  One* const one = find(key);
  if (one != nullptr && one->removed) {
    if (!one->published.values.empty()) {
      one->published.values.clear();
      fabric_.dispose(one->published);
    }
    queues_.erase(key);
  }
}

void MessageQueues::on_recorded(const Ticket& ticket, Moment now) {
  // Another one may have taken its place.
  if (One* const one = find(ticket.key); one != nullptr && one->number == ticket.number) {
    one->queue.on_journalled(now);
    ask_next(*one, now);
  }
}

void MessageQueues::on_answer(const fabric::ChannelKey& key, queues::StepAnswer answer,
                              Moment now) {
  One* const one = find(key);
  if (one == nullptr || !one->asking) {
    return;
  }
  queues::MessageQueue& queue = one->queue;
  std::visit(fabric::Cases{[&](queues::Answer<queues::Control>& control) {
                             queue.on_control(control, now);
                             if (control && queue.settings().events && !one->subscribed) {
                               // The queue is read in any case, with notifications or without.
                               one->subscribed = true;
                               one->link->subscribe(key);
                             }
                           },
                           [&](queues::Answer<std::vector<std::string>>& texts) {
                             queue.on_array(std::move(texts), now);
                           },
                           [&](queues::Answer<void>& written) { queue.on_written(written, now); }},
             answer);
  one->asking = false;
  ask_next(*one, now);
}

void MessageQueues::on_change(const fabric::ChannelKey& key, Moment now) {
  if (One* const one = find(key); one != nullptr && one->link != nullptr) {
    one->queue.on_event(now);
    ask_next(*one, now);
  }
}

void MessageQueues::ask_next(One& one, Moment now) {
  if (one.link != nullptr && !one.asking) {
    if (const auto step = one.queue.next(now)) {
      one.asking = true;
      one.link->ask(one.queue.key(), *step);
    }
  }
  take_output(one);
}

void MessageQueues::read(const fabric::ChannelKey& key, ReadSet set) {
  if (One* const one = find(key)) {
    ++one->asked;
    events_.push_back({.kind = Kind::read, .key = key, .number = one->number});
    events_.back().shown.set = set;
  }
}

void MessageQueues::write(const fabric::ChannelKey& key, const Write& write, Moment now) {
  if (One* const one = find(key)) {
    one->queue.write(write, now);
    take_output(*one);
    ask_next(*one, now);
    ++one->asked;
    events_.push_back({.kind = Kind::written, .key = key, .number = one->number});
  }
}

std::optional<MessageQueues::ChannelEvent> MessageQueues::next_event() {
  while (!events_.empty()) {
    ChannelEvent event = std::move(events_.front());
    events_.pop_front();
    One* const one = find(event.key);
    if (one == nullptr || one->number != event.number) {
      continue;
    }
    switch (event.kind) {
      case Kind::opened:
        if (one->draining) {
          continue;
        }
        // As with a controller's link: earlier requests are answered before it is restored.
        one->opens = one->asked > 0;
        if (one->opens) {
          continue;
        }
        break;
      case Kind::draining:
        if (!one->draining) {
          continue;
        }
        break;
      case Kind::down:
        one->opens = false;
        break;
      case Kind::read:
        --one->asked;
        event.shown = one->queue.snapshot(event.shown.set);
        one->queue.on_read(event.shown.set);
        break;
      case Kind::written:
        --one->asked;
        break;
      case Kind::changed:
        break;
    }
    return event;
  }
  return {};
}

void MessageQueues::on_event_delivered(const ChannelEvent& event) {
  One* const one = find(event.key);
  // The end of a call may have ended the queue.
  if (one == nullptr || one->number != event.number) {
    return;
  }
  if (event.kind == Kind::opened) {
    take_output(*one);
  } else if (event.kind == Kind::written) {
    one->queue.on_acknowledged();
    take_output(*one);
    if (!one->ours && !one->has_messages()) {
      review(event.key, *one);
    }
  }
  if (one->opens && !one->draining && one->asked == 0) {
    one->opens = false;
    events_.push_front({.kind = Kind::opened, .key = event.key, .number = one->number});
  }
}

void MessageQueues::take_output(One& one) {
  const queues::MessageQueue::Output output = one.queue.take_output();
  const fabric::ChannelKey& key = one.queue.key();
  for (const JournalEntry& entry : output.entries) {
    const bool waits = output.wait && &entry == &output.entries.back();
    host_.append(entry, waits ? Ticket{Ticket::Owner::queue, key, one.number} : Ticket{});
  }
  log(key, output);
  if (output.shows) {
    events_.push_back({.kind = Kind::changed, .key = key, .number = one.number});
  }
}

void MessageQueues::log(const fabric::ChannelKey& key, const queues::MessageQueue::Output& output) {
  for (const auto& line : output.lines) {
    host_.log(line.level, fmt::format("{}: {}", key.to_string(), line.text));
  }
  if (output.trouble) {
    host_.set_alarm({.kind = "queue", .subject = key.to_string()}, *output.trouble,
                    base::messages::check_queue_names());
  }
  if (output.filling) {
    host_.set_alarm({.kind = "queue_filling", .subject = key.to_string()}, *output.filling,
                    base::messages::start_queue_service());
  }
}

void MessageQueues::publish_numbers(Moment now) {
  for (auto& [key, one] : queues_) {
    publish_numbers(one, now);
  }
}

void MessageQueues::publish_numbers(One& one, Moment now) {
  if (!one.ours && !one.has_messages()) {
    return;
  }
  fabric::DataSample sample =
      queues::sample_of(one.queue.key(), one.queue.settings(), one.queue.view(), now.wall);
  const auto same = [](const fabric::Value& a, const fabric::Value& b) {
    return a.name == b.name && a.elements == b.elements && a.quality == b.quality;
  };
  if (!std::ranges::equal(sample.values, one.published.values, same)) {
    fabric_.publish(sample);
    one.published = std::move(sample);
  }
}

void MessageQueues::on_time(Moment now) {
  for (auto& [key, one] : queues_) {
    if (const auto time = one.next_time(); time && *time <= now.steady) {
      ask_next(one, now);
    }
  }
}

std::optional<SteadyTime> MessageQueues::next_time() const {
  std::optional<SteadyTime> first;
  for (const auto& [key, one] : queues_) {
    first = earliest({first, one.next_time()});
  }
  return first;
}

}  // namespace millrace::gateway::core
