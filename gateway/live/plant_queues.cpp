#include "gateway/live/plant_queues.hpp"

#include <algorithm>
#include <utility>

#include <boost/asio/post.hpp>

#include "fabric/queue_group.hpp"
#include "gateway/live/symbol_queue.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::live {

PlantQueues::PlantQueues(boost::asio::any_io_executor executor, std::function<Moment()> now,
                         QueueEvents& events)
    : executor_(std::move(executor)), now_(std::move(now)), events_(events) {}

PlantQueues::~PlantQueues() {
  for (auto& [key, one] : queues_) {
    one.queue->stop();
  }
}

/// In a turn of the loop of its own: what a call wants of its channel is never answered from
/// within.
template <typename Act>
void PlantQueues::soon(Act act) {
  boost::asio::post(executor_, [act = std::move(act), alive = std::weak_ptr(life_)] {
    if (!alive.expired()) {
      act();
    }
  });
}

void PlantQueues::begin(const fabric::ChannelKey& key, One& one, QueueBook book) {
  one.queue = std::make_shared<MachineQueue>(
      executor_, one.machine, one.settings, std::move(book), now_,
      QueueOutlet{.begin = [this] { events_.on_queue_event(); },
                  .record = [this](const auto& entries,
                                   auto recorded) { events_.record_of_queue(entries, recorded); },
                  .shows = [this, key] { soon([this, key] { events_.on_queue_change(key); }); },
                  .tell = [this, key](const auto& news) { events_.say_of_queue(key, news); }});
}

void PlantQueues::set(const std::vector<settings::MachineSettings>& machines,
                      const journal::Ledger& ledger) {
  for (auto& [key, one] : queues_) {
    one.leaving = true;
  }
  for (const settings::MachineSettings& machine : machines) {
    for (const queues::QueueSettings& settings : machine.queues) {
      const fabric::ChannelKey key = settings.key(machine.name);
      const auto [found, is_new] = queues_.try_emplace(key);
      One& one = found->second;
      one.leaving = false;
      if (is_new || one.settings != settings) {
        if (one.queue) {
          one.queue->stop();
        }
        one.machine = machine.name;
        one.settings = settings;
        const auto known = ledger.queues().find(key);
        begin(key, one, known == ledger.queues().end() ? QueueBook() : known->second);
        reach(key, one);
      }
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
  soon([this, key] {
    if (queues_.contains(key)) {
      events_.on_queue_open(key);
      queues_.at(key).queue->tell();
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
    soon([this, key] {
      if (const auto found = queues_.find(key); found != queues_.end() && found->second.retired) {
        events_.on_queue_retired(key);
      }
    });
  }
}

void PlantQueues::on_up(const std::string& machine, const std::vector<std::uint16_t>& channels,
                        const std::weak_ptr<cnc::ads::Client>& client) {
  Reach& way = reaches_[machine];
  way.client = client;
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
  const Reach& way = reaches_[one.machine];
  auto client = way.client.lock();
  if (one.leaving || !way.up || !client || !way.channels.contains(one.settings.channel)) {
    return;
  }
  one.ours = true;
  open(key, one);
  if (!one.queue->up()) {
    one.queue->on_up(std::make_unique<SymbolQueue>(std::move(client), one.settings));
  }
}

void PlantQueues::on_down(const std::string& machine, const std::string& reason) {
  reaches_[machine].up = false;
  for (auto& [key, one] : queues_) {
    if (one.machine != machine) {
      continue;
    }
    one.queue->on_down(reason);
    if (one.queue->queue().book().waiting() == 0 && one.ours) {
      soon([this, key = key, reason] {
        if (queues_.contains(key)) {
          events_.on_queue_down(key, reason);
        }
      });
    }
  }
}

void PlantQueues::on_left(const std::string& machine, std::uint16_t channel,
                          const std::string& reason) {
  auto& channels = reaches_[machine].channels;
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
    found->second.queue->stop();
    if (!found->second.told.values.empty()) {
      fabric::DataSample gone = found->second.told;
      gone.values.clear();
      events_.tell_queue(gone);
    }
    queues_.erase(found);
  }
}

void PlantQueues::read(const fabric::ChannelKey& key, ReadSet look) {
  soon([this, key, look] {
    if (const auto found = queues_.find(key); found != queues_.end()) {
      events_.on_queue_read(key, found->second.queue->look(look));
    }
  });
}

void PlantQueues::write(const fabric::ChannelKey& key, Variable variable, const Value& value) {
  const auto found = queues_.find(key);
  if (found == queues_.end()) {
    return;
  }
  found->second.queue->write(variable, value);
  soon([this, key] {
    if (queues_.contains(key)) {
      events_.on_queue_write(key);
    }
    // The end of the call may have ended the queue.
    if (const auto still = queues_.find(key); still != queues_.end()) {
      still->second.queue->on_acknowledged();
      if (!still->second.ours && still->second.queue->queue().book().waiting() == 0) {
        review(key, still->second);
      }
    }
  });
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
  fabric::DataSample sample = sample_of(key, one.settings, one.queue->queue().view(), now_().wall);
  const auto same = [](const fabric::Value& a, const fabric::Value& b) {
    return a.name == b.name && a.elements == b.elements && a.quality == b.quality;
  };
  if (std::ranges::equal(sample.values, one.told.values, same)) {
    return;
  }
  one.told = sample;
  events_.tell_queue(sample);
}

fabric::DataSample sample_of(const fabric::ChannelKey& key, const queues::QueueSettings& settings,
                             const queues::QueueView& view, fabric::Time at) {
  constexpr std::chrono::seconds period{1};
  fabric::DataSample sample{.key = key,
                            .group = std::string(fabric::queue_group),
                            .at = at,
                            .period = period,
                            .wanted = period};
  const auto quality = view.trouble.empty() ? fabric::Quality::good : fabric::Quality::stale;
  const auto number = [&](std::string_view name, std::int64_t value, fabric::Quality how) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::uns32,
                             .quality = how,
                             .at = at,
                             .elements = std::vector<std::int64_t>{value}});
    if (how != fabric::Quality::good) {
      sample.values.back().reason = fit_reason(view.trouble);
    }
  };
  const auto text = [&](std::string_view name, const std::string& value) {
    sample.values.push_back({.name = std::string(name),
                             .type = fabric::ValueType::string,
                             .quality = fabric::Quality::good,
                             .at = at,
                             .elements = std::vector<std::string>{value}});
  };
  const bool known = view.control.has_value();
  const queues::Control control = view.control.value_or(queues::Control{0, 0, 0});
  const auto ring = known ? quality : fabric::Quality::stale;
  number("last_filled", control.last_filled, ring);
  number("last_get", control.last_get, ring);
  number("elements", control.elements, ring);
  number("messages", static_cast<std::int64_t>(view.messages), fabric::Quality::good);
  number("answered", static_cast<std::int64_t>(view.answered), fabric::Quality::good);
  number("waiting", static_cast<std::int64_t>(view.waiting), fabric::Quality::good);
  number("response_state", view.response_state, fabric::Quality::good);
  text("response", view.response);
  text("array", settings.array);
  text("uuid", settings.uuid);
  text("drain", settings.drain == queues::Drain::journalled ? "JOURNALLED" : "WHEN_ANSWERED");
  return sample;
}

}  // namespace millrace::gateway::live
