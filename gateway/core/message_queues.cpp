#include "gateway/core/message_queues.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "gateway/queues/message_queue.hpp"

namespace millrace::gateway::core {

void MessageQueues::set(const std::vector<settings::MachineSettings>& machines,
                        const std::map<fabric::ChannelKey, QueueLog>& known, Moment now) {
  for (auto& [key, served] : queues_) {
    served.removed = true;
  }
  for (const settings::MachineSettings& machine : machines) {
    for (const queues::QueueSettings& settings : machine.queues) {
      const fabric::ChannelKey key = settings.key(machine.name);
      Served* served = find(key);
      if (served == nullptr) {
        const auto queue_log = known.find(key);
        served = &queues_
                      .try_emplace(key, machine.name, settings,
                                   queue_log == known.end() ? QueueLog() : queue_log->second)
                      .first->second;
        served->number = ++begun_;
      } else if (served->queue.settings() != settings) {
        served->queue.change(settings);
        go_down(*served, base::messages::configuration_changed());
      }
      served->removed = false;
      // Also one that was leaving when its link came up.
      reach(key, *served, now);
      review(key, *served);
    }
  }
  for (auto& [key, served] : queues_) {
    if (served.removed) {
      review(key, served);
    }
  }
}

MessageQueues::Served* MessageQueues::find(const fabric::ChannelKey& key) {
  const auto found = queues_.find(key);
  return found == queues_.end() ? nullptr : &found->second;
}

/// Whether its calls exist: those of queues that are ours, and those of messages in the journal.
void MessageQueues::review(const fabric::ChannelKey& key, Served& served) {
  if (!served.removed && (served.owned || served.has_messages())) {
    open(key, served);
  } else if (!served.draining) {
    served.draining = true;
    events_.push_back({.kind = Kind::draining, .key = key, .number = served.number});
  }
}

void MessageQueues::open(const fabric::ChannelKey& key, Served& served) {
  served.draining = false;
  events_.push_back({.kind = Kind::opened, .key = key, .number = served.number});
}

/// Reads the queue if its channel is ours and the link is up.
void MessageQueues::reach(const fabric::ChannelKey& key, Served& served, Moment now) {
  const Reach& way = machines_[served.machine];
  if (served.removed || way.link == nullptr ||
      !way.channels.contains(served.queue.settings().channel)) {
    return;
  }
  served.owned = true;
  open(key, served);
  if (served.link == nullptr) {
    served.link = way.link;
    served.link->open(key, served.queue.settings());
    served.asking = false;
    served.subscribed = false;
    served.queue.on_up(now);
    ask_next(served, now);
  }
}

void MessageQueues::on_up(const std::string& machine, const machines::Channels& channels,
                          machines::Controller& link, Moment now) {
  Reach& way = machines_[machine];
  way.channels.insert(channels.begin(), channels.end());
  way.link = &link;
  for (auto& [key, served] : queues_) {
    if (served.machine == machine) {
      reach(key, served, now);
    }
  }
}

void MessageQueues::go_down(Served& served, const fabric::Message& reason) {
  served.link = nullptr;
  served.asking = false;
  served.queue.on_down(reason);
  take_output(served);
}

void MessageQueues::on_down(const std::string& machine, const fabric::Message& reason) {
  machines_[machine].link = nullptr;
  for (auto& [key, served] : queues_) {
    if (served.machine != machine) {
      continue;
    }
    go_down(served, reason);
    if (!served.has_messages() && served.owned) {
      events_.push_back(
          {.kind = Kind::down, .key = key, .reason = reason, .number = served.number});
    }
  }
}

void MessageQueues::lose_channel(const fabric::ChannelKey& key, Served& served,
                                 const fabric::Message& reason) {
  served.owned = false;
  go_down(served, reason);
  review(key, served);
}

void MessageQueues::on_channel_lost(const std::string& machine, std::uint16_t channel,
                                    const fabric::Message& reason) {
  machines_[machine].channels.erase(channel);
  for (auto& [key, served] : queues_) {
    if (served.machine == machine && served.queue.settings().channel == channel) {
      lose_channel(key, served, reason);
    }
  }
}

void MessageQueues::on_link_gone(const std::string& machine, const fabric::Message& reason) {
  machines_.erase(machine);
  for (auto& [key, served] : queues_) {
    if (served.machine == machine) {
      lose_channel(key, served, reason);
    }
  }
}

void MessageQueues::on_over(const fabric::ChannelKey& key) {
  Served* const served = find(key);
  if (served != nullptr && served->removed) {
    if (!served->published.values.empty()) {
      served->published.values.clear();
      fabric_.dispose(served->published);
    }
    queues_.erase(key);
  }
}

void MessageQueues::on_recorded(const Ticket& ticket, Moment now) {
  // Another one may have taken its place.
  if (Served* const served = find(ticket.key);
      served != nullptr && served->number == ticket.number) {
    served->queue.on_journalled(now);
    ask_next(*served, now);
  }
}

void MessageQueues::on_answer(const fabric::ChannelKey& key, queues::StepAnswer answer,
                              Moment now) {
  Served* const served = find(key);
  if (served == nullptr || !served->asking) {
    return;
  }
  queues::MessageQueue& queue = served->queue;
  std::visit(fabric::Cases{[&](queues::Answer<queues::Control>& control) {
                             queue.on_control(control, now);
                             if (control && queue.settings().events && !served->subscribed) {
                               // The queue is read in any case, with notifications or without.
                               served->subscribed = true;
                               served->link->subscribe(key);
                             }
                           },
                           [&](queues::Answer<std::vector<std::string>>& texts) {
                             queue.on_array(std::move(texts), now);
                           },
                           [&](queues::Answer<void>& written) { queue.on_written(written, now); }},
             answer);
  served->asking = false;
  ask_next(*served, now);
}

void MessageQueues::on_change(const fabric::ChannelKey& key, Moment now) {
  if (Served* const served = find(key); served != nullptr && served->link != nullptr) {
    served->queue.on_event(now);
    ask_next(*served, now);
  }
}

void MessageQueues::ask_next(Served& served, Moment now) {
  if (served.link != nullptr && !served.asking) {
    if (const auto step = served.queue.next(now)) {
      served.asking = true;
      served.link->ask(served.queue.key(), *step);
    }
  }
  take_output(served);
}

void MessageQueues::read(const fabric::ChannelKey& key, ReadSet set) {
  if (Served* const served = find(key)) {
    ++served->asked;
    events_.push_back({.kind = Kind::read, .key = key, .number = served->number});
    events_.back().shown.set = set;
  }
}

void MessageQueues::write(const fabric::ChannelKey& key, const Write& write, Moment now) {
  if (Served* const served = find(key)) {
    served->queue.write(write, now);
    take_output(*served);
    ask_next(*served, now);
    ++served->asked;
    events_.push_back({.kind = Kind::written, .key = key, .number = served->number});
  }
}

std::optional<MessageQueues::ChannelEvent> MessageQueues::next_event() {
  while (!events_.empty()) {
    ChannelEvent event = std::move(events_.front());
    events_.pop_front();
    Served* const served = find(event.key);
    if (served == nullptr || served->number != event.number) {
      continue;
    }
    switch (event.kind) {
      case Kind::opened:
        if (served->draining) {
          continue;
        }
        // As with a controller's link: earlier requests are answered before it is restored.
        served->opens = served->asked > 0;
        if (served->opens) {
          continue;
        }
        break;
      case Kind::draining:
        if (!served->draining) {
          continue;
        }
        break;
      case Kind::down:
        served->opens = false;
        break;
      case Kind::read:
        --served->asked;
        event.shown = served->queue.snapshot(event.shown.set);
        served->queue.on_read(event.shown.set);
        break;
      case Kind::written:
        --served->asked;
        break;
      case Kind::changed:
        break;
    }
    return event;
  }
  return {};
}

void MessageQueues::on_event_delivered(const ChannelEvent& event) {
  Served* const served = find(event.key);
  // The end of a call may have ended the queue.
  if (served == nullptr || served->number != event.number) {
    return;
  }
  if (event.kind == Kind::opened) {
    take_output(*served);
  } else if (event.kind == Kind::written) {
    served->queue.on_acknowledged();
    take_output(*served);
    if (!served->owned && !served->has_messages()) {
      review(event.key, *served);
    }
  }
  if (served->opens && !served->draining && served->asked == 0) {
    served->opens = false;
    events_.push_front({.kind = Kind::opened, .key = event.key, .number = served->number});
  }
}

void MessageQueues::take_output(Served& served) {
  const queues::MessageQueue::Output output = served.queue.take_output();
  const fabric::ChannelKey& key = served.queue.key();
  for (const JournalEntry& entry : output.entries) {
    const bool waits = output.wait && &entry == &output.entries.back();
    host_.append(entry, waits ? Ticket{Ticket::Owner::queue, key, served.number} : Ticket{});
  }
  log(key, output);
  if (output.shows) {
    events_.push_back({.kind = Kind::changed, .key = key, .number = served.number});
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
  for (auto& [key, served] : queues_) {
    publish_numbers(served, now);
  }
}

void MessageQueues::publish_numbers(Served& served, Moment now) {
  if (!served.owned && !served.has_messages()) {
    return;
  }
  fabric::DataSample sample =
      queues::sample_of(served.queue.key(), served.queue.settings(), served.queue.view(), now.wall);
  const auto same = [](const fabric::Value& a, const fabric::Value& b) {
    return a.name == b.name && a.elements == b.elements && a.quality == b.quality;
  };
  if (!std::ranges::equal(sample.values, served.published.values, same)) {
    fabric_.publish(sample);
    served.published = std::move(sample);
  }
}

void MessageQueues::on_time(Moment now) {
  for (auto& [key, served] : queues_) {
    if (const auto time = served.next_time(); time && *time <= now.steady) {
      ask_next(served, now);
    }
  }
}

std::optional<SteadyTime> MessageQueues::next_time() const {
  std::optional<SteadyTime> first;
  for (const auto& [key, served] : queues_) {
    first = earliest({first, served.next_time()});
  }
  return first;
}

}  // namespace millrace::gateway::core
