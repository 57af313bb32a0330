#include "tests/simulation/fabric/fabric.hpp"

#include <algorithm>
#include <utility>

#include <fmt/ranges.h>

namespace millrace::tests::simulation {

EndNumber Fabric::add(Process& process) {
  auto end = std::make_unique<End>();
  end->process = &process;
  end->life = process.life();
  ends_.push_back(std::move(end));
  return ends_.size() - 1;
}

EndNumber Fabric::join(Process& process, GatewayListener& listener, GatewayMonitorListener& watch) {
  const EndNumber number = add(process);
  ends_[number]->gateway = &listener;
  gateway_topics_.join(number, process, watch);
  for (EndNumber other = 0; other < number; ++other) {
    if (ends_[other]->there && ends_[other]->instance != nullptr) {
      pair_up(number, other);
    }
  }
  return number;
}

EndNumber Fabric::join(Process& process, InstanceListener& listener,
                       const fabric::InstanceIdentity& identity) {
  const EndNumber number = add(process);
  ends_[number]->instance = &listener;
  ends_[number]->identity = identity;
  for (EndNumber other = 0; other < number; ++other) {
    if (ends_[other]->there && ends_[other]->gateway != nullptr) {
      pair_up(other, number);
    }
  }
  return number;
}

void Fabric::pair_up(EndNumber gateway, EndNumber instance) {
  auto pair = std::make_shared<Pair>();
  pair->gateway = gateway;
  pair->instance = instance;
  pairs_.push_back(pair);
  refresh(pair);
}

std::vector<Fabric::PairPointer> Fabric::pairs_of(EndNumber end) const {
  std::vector<PairPointer> found;
  std::ranges::copy_if(pairs_, std::back_inserter(found), [&](const PairPointer& pair) {
    return pair->gateway == end || pair->instance == end;
  });
  return found;
}

std::vector<EndNumber> Fabric::ends() const {
  std::vector<EndNumber> found;
  for (EndNumber end = 0; end < ends_.size(); ++end) {
    if (ends_[end]->there) {
      found.push_back(end);
    }
  }
  return found;
}

void Fabric::leave(EndNumber end, bool in_order) {
  ends_[end]->there = false;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.leave(end, in_order);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    const bool is_instance = pair->instance == end;
    Side& side = is_instance ? pair->of_instance : pair->of_gateway;
    if (in_order && side.path && ends_[is_instance ? pair->gateway : pair->instance]->awake) {
      agenda_.touches(parties(*pair));
      // Its last samples arrive before the farewell.
      if (is_instance) {
        arrive_replies(pair);
      }
      ++side.epoch;
      side.passes = false;
      within(pair, delay(false), [this, pair, is_instance] { lose_known(pair, is_instance); });
    } else {
      refresh(pair);
    }
  }
}

void Fabric::frozen(EndNumber end) {
  ends_[end]->awake = false;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.frozen(end);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    refresh(pair);
  }
}

void Fabric::thawed(EndNumber end, Time after) {
  ends_[end]->awake = true;
  if (ends_[end]->gateway != nullptr) {
    gateway_topics_.thawed(end, after);
  }
  for (const PairPointer& pair : pairs_of(end)) {
    if (after > conditions.lease) {
      // It has received nothing from the others for longer than their leases.
      Side& other = pair->instance == end ? pair->of_gateway : pair->of_instance;
      lose_known(pair, pair->gateway == end);
      other.passes = false;
      ++other.epoch;
    }
    refresh(pair);
  }
}

void Fabric::set_path(EndNumber from, EndNumber to, bool open) {
  gateway_topics_.set_path(from, to, open);
  for (const PairPointer& pair : pairs_) {
    if (pair->instance == from && pair->gateway == to) {
      pair->of_instance.path = open;
      refresh(pair);
    } else if (pair->gateway == from && pair->instance == to) {
      pair->of_gateway.path = open;
      refresh(pair);
    }
  }
}

void Fabric::open_all_paths() {
  gateway_topics_.open_all_paths();
  for (const PairPointer& pair : pairs_) {
    pair->of_instance.path = true;
    pair->of_gateway.path = true;
    refresh(pair);
  }
}

std::uint64_t Fabric::parties(const Pair& pair) const {
  return hearing(*ends_[pair.gateway]) | hearing(*ends_[pair.instance]);
}

void Fabric::within(const PairPointer& pair, Time delay, std::function<void()> act) {
  agenda_.after(delay, {.parties = parties(*pair)}, std::move(act));
}

void Fabric::fetch(EndNumber reader, EndNumber writer, Time delay, std::function<void()> act) {
  const Process& to = *ends_[reader]->process;
  const Process& from = *ends_[writer]->process;
  agenda_.after(delay,
                {.parties = hearing(*ends_[reader]),
                 .reads = from.outbox(),
                 .means = agenda_.meaning("fetch", reader, writer),
                 .lives = {.first = &to.life(), .second = &from.life()}},
                std::move(act));
}

Time Fabric::delay(bool again) {
  if (again || random_.chance(conditions.lost)) {
    // The time to the next heartbeat and the repeated sample.
    return random_.between(10ms, 100ms);
  }
  return random_.between(conditions.delay_least, conditions.delay_most);
}

// Discovery and loss of ends.

void Fabric::refresh(const PairPointer& pair) {
  refresh(pair, pair->of_instance, *ends_[pair->instance], true);
  refresh(pair, pair->of_gateway, *ends_[pair->gateway], false);
  send_requests(pair, true);
  send_replies(pair, true);
}

void Fabric::refresh(const PairPointer& pair, Side& side, const End& other, bool of_instance) {
  const bool passes = side.path && other.there && other.awake;
  if (passes == side.passes) {
    return;
  }
  side.passes = passes;
  const std::uint64_t epoch = ++side.epoch;
  // Without calls it may be silent for longer.
  const Time longest = of_instance ? conditions.lease * 3 : conditions.lease;
  const Time wait = passes ? random_.between(conditions.discovery_least, conditions.discovery_most)
                           : random_.between(conditions.lease / 2, longest);
  agenda_.after(wait, {.parties = parties(*pair), .timer = true},
                [this, pair, &side, epoch, passes, of_instance] {
                  if (side.epoch == epoch) {
                    passes ? find(pair, of_instance) : lose_known(pair, of_instance);
                  }
                });
}

void Fabric::find(const PairPointer& pair, bool of_instance) {
  Side& side = of_instance ? pair->of_instance : pair->of_gateway;
  if (!of_instance) {
    if (!side.reader) {
      side.reader = true;
      side.writer = true;
      pair->requests = 0;
    }
    send_requests(pair);
    send_replies(pair);
    return;
  }
  // Its two endpoints are discovered in any order.
  const bool reader_first = random_.chance(50);
  discover(pair, reader_first);
  agenda_.after(random_.between(Time{}, 2ms), {.parties = parties(*pair), .timer = true},
                [this, pair, reader_first, epoch = side.epoch] {
                  if (pair->of_instance.epoch == epoch) {
                    discover(pair, !reader_first);
                  }
                });
}

void Fabric::discover(const PairPointer& pair, bool reader) {
  End& gateway = *ends_[pair->gateway];
  const End& instance = *ends_[pair->instance];
  Side& side = pair->of_instance;
  gateway.registry_knows =
      meaning_of(gateway.registry_knows, reader, pair->instance, instance.identity.draining);
  if (reader) {
    gateway.registry.reader_seen(reader_of(pair->instance), {instance.identity, pair->instance},
                                 fabric::SteadyTime(agenda_.now()));
    gateway.registry.matched(reader_of(pair->instance), true);
    static_cast<void>(gateway.requests[instance.identity.id]);
    side.reader = true;
  } else {
    gateway.registry.writer_seen(writer_of(pair->instance),
                                 {instance.identity.id, pair->instance, instance.identity.uuid});
    gateway.registry.matched(writer_of(pair->instance), true);
    if (!side.writer) {
      side.writer = true;
      pair->replies = 0;
    }
  }
  look_around(pair->gateway);
  send_requests(pair);
  send_replies(pair);
}

void Fabric::lose_known(const PairPointer& pair, bool of_instance) {
  Side& side = of_instance ? pair->of_instance : pair->of_gateway;
  side.reader = false;
  side.writer = false;
  if (!of_instance) {
    orphan(pair->instance, pair->gateway);
    pair->requests = 0;
    return;
  }
  End& gateway = *ends_[pair->gateway];
  gateway.registry_knows = meaning_of(gateway.registry_knows, "gone", pair->instance);
  gateway.registry.endpoint_gone(reader_of(pair->instance));
  gateway.registry.endpoint_gone(writer_of(pair->instance));
  pair->replies = 0;
  look_around(pair->gateway);
}

void Fabric::look_around(EndNumber number) {
  End& end = *ends_[number];
  if (end.discovery_due || !end.there) {
    return;
  }
  end.discovery_due = true;
  agenda_.after(random_.between(Time{}, 500us),
                {.parties = end.process->inbox(),
                 .reads = end.process->parties(),
                 .means = agenda_.meaning("look around", number),
                 .lives = {.first = &end.process->life()}},
                [this, number, &end] {
                  end.process->run(end.life, [this, number] { take_changes(number); });
                });
}

void Fabric::take_changes(EndNumber number) {
  End& end = *ends_[number];
  end.discovery_due = false;
  // An instance that leaves may have answered just before.
  take_replies(number);
  const auto changes = end.registry.changes();
  if (changes.gone.empty() && changes.ready.empty() && changes.changed.empty()) {
    return;
  }
  agenda_.touches(end.process->parties());
  end.registry_knows = meaning_of(end.registry_knows, "told");
  for (const auto& gone : changes.gone) {
    end.gateway->on_instance_gone(gone);
  }
  for (const auto& ready : changes.ready) {
    end.gateway->on_instance_ready(ready);
  }
  for (const auto& changed : changes.changed) {
    end.gateway->on_instance_changed(changed);
  }
}

void Fabric::change_identity(EndNumber number, const fabric::InstanceIdentity& identity) {
  ends_[number]->identity = identity;
  for (const PairPointer& pair : pairs_of(number)) {
    within(pair, delay(false), [this, pair] {
      if (pair->of_instance.reader && pair->of_instance.passes) {
        discover(pair, true);
      }
    });
  }
}

// The state of the fabric's ends as text.

std::string Fabric::place_of(EndNumber number) const {
  const End& end = *ends_[number];
  return end.gateway != nullptr ? place_of_gateway(end, number) : place_of_instance(end, number);
}

std::string Fabric::place_of_gateway(const End& end, EndNumber number) const {
  std::string words = fmt::format("{} {}", end.discovery_due, end.registry_knows);
  for (const auto& [key, reply] : end.replies_in) {
    words += fmt::format("|{} {} {} {} {}", reply.instance.to_string(), reply.call.to_string(),
                         reply.attempt, reply.state, reply.text);
  }
  for (const auto& [uuid, writer] : end.requests) {
    words += "|" + uuid.to_string();
  }
  for (const PairPointer& pair : pairs_of(number)) {
    const Side& side = pair->of_instance;
    words += fmt::format("|{} {} {} {} {} {} {}", side.path, side.passes, side.reader, side.writer,
                         side.epoch, pair->replies, pair->replies_due);
  }
  return words;
}

std::string Fabric::place_of_instance(const End& end, EndNumber number) const {
  std::string words = fmt::format("{} {}", end.drain_due, end.replies.last);
  for (const auto& [key, cached] : end.requests_in) {
    words += fmt::format("|{} {} {} {} {}", key.epoch, static_cast<int>(cached.instance_state),
                         cached.value.call.to_string(), cached.value.attempt,
                         cached.value.assigned.to_string());
  }
  for (const auto& [key, gateways] : end.requested_by) {
    words += fmt::format("|{} {}", key.epoch, fmt::join(gateways, ","));
  }
  for (const PairPointer& pair : pairs_of(number)) {
    const Side& side = pair->of_gateway;
    words += fmt::format("|{} {} {} {} {} {} {}", side.path, side.passes, side.reader, side.writer,
                         side.epoch, pair->requests, pair->requests_due);
  }
  return words;
}

}  // namespace millrace::tests::simulation
