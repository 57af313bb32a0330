#include "tests/simulation/fabric/gateway_topics.hpp"

#include <algorithm>
#include <utility>

#include "tests/simulation/fabric/fabric.hpp"

namespace millrace::tests::simulation {

void GatewayTopics::join(EndNumber number, Process& process, GatewayMonitorListener& listener) {
  End& end = ends_[number];
  end.process = &process;
  end.life = process.life();
  end.listener = &listener;
  for (const auto& [other, other_end] : ends_) {
    if (other != number && other_end.there) {
      ways_.push_back(std::make_shared<Way>(Way{.from = other, .to = number}));
      refresh(ways_.back());
      ways_.push_back(std::make_shared<Way>(Way{.from = number, .to = other}));
      refresh(ways_.back());
    }
  }
}

void GatewayTopics::leave(EndNumber end, bool in_order) {
  ends_.at(end).there = false;
  for (const WayPointer& way : ways_) {
    if (way->from == end && in_order && way->passes && ends_.at(way->to).awake) {
      // Its last samples arrive before the farewell.
      arrive(way);
      ++way->epoch;
      way->passes = false;
      after(*way, delay(), [this, way] { lose(way); });
    } else if (way->from == end || way->to == end) {
      refresh(way);
    }
  }
}

void GatewayTopics::frozen(EndNumber end) {
  ends_.at(end).awake = false;
  for (const WayPointer& way : ways_) {
    if (way->from == end) {
      refresh(way);
    }
  }
}

void GatewayTopics::thawed(EndNumber end, Time after) {
  ends_.at(end).awake = true;
  for (const WayPointer& way : ways_) {
    if (way->to == end && after > conditions_.lease) {
      // It has received nothing from the others for longer than their leases.
      lose(way);
      way->passes = false;
      ++way->epoch;
    }
    if (way->to == end || way->from == end) {
      refresh(way);
    }
  }
}

void GatewayTopics::set_path(EndNumber from, EndNumber to, bool open) {
  for (const WayPointer& way : ways_) {
    if (way->from == from && way->to == to) {
      way->path = open;
      refresh(way);
    }
  }
}

void GatewayTopics::open_all_paths() {
  for (const WayPointer& way : ways_) {
    way->path = true;
    refresh(way);
  }
}

Time GatewayTopics::delay() {
  return random_.chance(conditions_.lost)
             ? random_.between(10ms, 100ms)
             : random_.between(conditions_.delay_least, conditions_.delay_most);
}

void GatewayTopics::after(const Way& way, Time delay, std::function<void()> act) {
  const std::uint64_t parties =
      ends_.at(way.from).process->parties() | ends_.at(way.to).process->parties();
  agenda_.after(delay, {.parties = parties}, std::move(act));
}

void GatewayTopics::refresh(const WayPointer& way) {
  const End& from = ends_.at(way->from);
  const bool passes = way->path && from.there && from.awake && ends_.at(way->to).there;
  if (passes != way->passes) {
    way->passes = passes;
    const Time wait = passes
                          ? random_.between(conditions_.discovery_least, conditions_.discovery_most)
                          : random_.between(conditions_.lease / 2, conditions_.lease);
    after(*way, wait, [this, way, epoch = ++way->epoch, passes] {
      if (way->epoch == epoch) {
        passes ? find(way) : lose(way);
      }
    });
  }
  send(way);
}

void GatewayTopics::find(const WayPointer& way) {
  if (!std::exchange(way->found, true)) {
    way->machines = 0;
    way->channels = 0;
  }
  send(way);
}

void GatewayTopics::lose(const WayPointer& way) {
  way->found = false;
  way->machines = 0;
  way->channels = 0;
  End& to = ends_.at(way->to);
  if (!to.there) {
    return;
  }
  for (const auto& [place, gateway] : to.known) {
    if (place.second == way->from) {
      to.machines_in[place] = std::nullopt;
    }
  }
  wake(way->to);
}

void GatewayTopics::publish(EndNumber number, const fabric::MachineStatus& status) {
  End& end = ends_.at(number);
  end.machines[status.machine] = {++end.last, status};
  send(number);
}

void GatewayTopics::publish(EndNumber number, const fabric::ChannelStatus& status) {
  End& end = ends_.at(number);
  end.channels[status.key] = {++end.last, status};
  send(number);
}

void GatewayTopics::let_go(EndNumber number, const std::string& machine) {
  End& end = ends_.at(number);
  end.machines[machine] = {++end.last, std::nullopt};
  send(number);
}

void GatewayTopics::let_go(EndNumber number, const Key& key) {
  End& end = ends_.at(number);
  end.channels[key] = {++end.last, std::nullopt};
  send(number);
}

void GatewayTopics::subscribe_channels(EndNumber end) {
  if (!std::exchange(ends_.at(end).watches_channels, true)) {
    for (const WayPointer& way : ways_) {
      if (way->to == end) {
        send(way);
      }
    }
  }
}

bool GatewayTopics::hears(EndNumber to, EndNumber from) const {
  return std::ranges::any_of(ways_, [&](const WayPointer& way) {
    const End& sender = ends_.at(way->from);
    return way->from == from && way->to == to && way->found && way->passes && !way->due &&
           sender.awake && ends_.at(to).awake && !ends_.at(to).due;
  });
}

void GatewayTopics::send(EndNumber from) {
  for (const WayPointer& way : ways_) {
    if (way->from == from) {
      send(way);
    }
  }
}

void GatewayTopics::send(const WayPointer& way) {
  if (!std::exchange(way->due, true)) {
    after(*way, delay(), [this, way] {
      way->due = false;
      arrive(way);
    });
  }
}

void GatewayTopics::arrive(const WayPointer& way) {
  End& from = ends_.at(way->from);
  End& to = ends_.at(way->to);
  if (!from.there || !to.there || !way->passes || !way->found) {
    return;
  }
  for (const auto& [machine, sample] : from.machines) {
    const std::pair place(machine, way->from);
    if (sample.number <= way->machines || way->from == way->to) {
      continue;
    }
    if (sample.value) {
      to.known[place] = sample.value->gateway;
      to.machines_in[place] = sample.value;
    } else if (to.known.contains(place)) {
      to.machines_in[place] = std::nullopt;
    }
  }
  way->machines = from.last;
  if (to.watches_channels) {
    for (const auto& [key, sample] : from.channels) {
      if (sample.number > way->channels && sample.value) {
        to.channels_in[key] = *sample.value;
      }
    }
    way->channels = from.last;
  }
  wake(way->to);
}

void GatewayTopics::wake(EndNumber number) {
  End& end = ends_.at(number);
  if (!end.there || (end.machines_in.empty() && end.channels_in.empty()) ||
      std::exchange(end.due, true)) {
    return;
  }
  agenda_.after(random_.between(Time{}, 300us), {.parties = end.process->parties()},
                [this, &end] { end.process->run(end.life, [this, &end] { take(end); }); });
}

void GatewayTopics::take(End& end) {
  end.due = false;
  // Samples are delivered before the loss of their writer: a gateway's loss is judged by its last
  // ones.
  for (const auto& [key, status] : std::exchange(end.channels_in, {})) {
    end.listener->on_channel(status);
  }
  for (const auto& [place, status] : std::exchange(end.machines_in, {})) {
    if (status) {
      end.listener->on_machine(*status);
    } else if (const auto known = end.known.extract(place); !known.empty()) {
      end.listener->on_machine_gone(place.first, known.mapped());
    }
  }
}

}  // namespace millrace::tests::simulation
