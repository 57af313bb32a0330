#include "tests/simulation/fabric/fabric.hpp"

#include <algorithm>
#include <utility>

namespace millrace::tests::simulation {

namespace {

fabric::EndpointHandle reader_of(EndNumber end) {
  return 2 * end + 1;
}

fabric::EndpointHandle writer_of(EndNumber end) {
  return 2 * end + 2;
}

}  // namespace

EndNumber Fabric::add(Process& process) {
  auto end = std::make_unique<End>();
  end->process = &process;
  end->life = process.life();
  ends_.push_back(std::move(end));
  return ends_.size() - 1;
}

EndNumber Fabric::join(Process& process, GatewayEars& ears) {
  const EndNumber number = add(process);
  ends_[number]->gateway = &ears;
  for (EndNumber other = 0; other < number; ++other) {
    if (ends_[other]->there && ends_[other]->instance != nullptr) {
      pair_up(number, other);
    }
  }
  return number;
}

EndNumber Fabric::join(Process& process, InstanceEars& ears,
                       const fabric::InstanceIdentity& identity) {
  const EndNumber number = add(process);
  ends_[number]->instance = &ears;
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

void Fabric::leave(EndNumber end, bool told) {
  ends_[end]->there = false;
  for (const PairPointer& pair : pairs_of(end)) {
    const bool is_instance = pair->instance == end;
    Side& side = is_instance ? pair->of_instance : pair->of_gateway;
    if (told && side.path && ends_[is_instance ? pair->gateway : pair->instance]->awake) {
      // Before the good-bye came its last samples.
      if (is_instance) {
        arrive_replies(pair);
      }
      ++side.epoch;
      side.heard = false;
      within(pair, delay(false), [this, pair, is_instance] { lose_known(pair, is_instance); });
    } else {
      refresh(pair);
    }
  }
}

void Fabric::frozen(EndNumber end) {
  ends_[end]->awake = false;
  for (const PairPointer& pair : pairs_of(end)) {
    refresh(pair);
  }
}

void Fabric::thawed(EndNumber end, Time after) {
  ends_[end]->awake = true;
  for (const PairPointer& pair : pairs_of(end)) {
    if (after > weather.lease) {
      // It has heard from nobody for longer than their leases.
      Side& other = pair->instance == end ? pair->of_gateway : pair->of_instance;
      lose_known(pair, pair->gateway == end);
      other.heard = false;
      ++other.epoch;
    }
    refresh(pair);
  }
}

void Fabric::set_path(EndNumber from, EndNumber to, bool open) {
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
  for (const PairPointer& pair : pairs_) {
    pair->of_instance.path = true;
    pair->of_gateway.path = true;
    refresh(pair);
  }
}

std::uint64_t Fabric::parties(const Pair& pair) const {
  return ends_[pair.gateway]->process->parties() | ends_[pair.instance]->process->parties();
}

void Fabric::within(const PairPointer& pair, Time delay, std::function<void()> act) {
  agenda_.after(delay, {.parties = parties(*pair)}, std::move(act));
}

Time Fabric::delay(bool again) {
  if (again || random_.chance(weather.lost)) {
    // The next heartbeat, and the sample once more.
    return random_.between(10ms, 100ms);
  }
  return random_.between(weather.delay_least, weather.delay_most);
}

void Fabric::refresh(const PairPointer& pair) {
  refresh(pair, pair->of_instance, *ends_[pair->instance], true);
  refresh(pair, pair->of_gateway, *ends_[pair->gateway], false);
  send_requests(pair, true);
  send_replies(pair, true);
}

void Fabric::refresh(const PairPointer& pair, Side& side, const End& other, bool of_instance) {
  const bool heard = side.path && other.there && other.awake;
  if (heard == side.heard) {
    return;
  }
  side.heard = heard;
  const std::uint64_t epoch = ++side.epoch;
  const Time wait = heard ? random_.between(weather.discovery_least, weather.discovery_most)
                          : random_.between(weather.lease / 2, weather.lease);
  agenda_.after(wait, {.parties = parties(*pair), .timer = true},
                [this, pair, &side, epoch, heard, of_instance] {
                  if (side.epoch == epoch) {
                    heard ? find(pair, of_instance) : lose(pair, of_instance);
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
  // Its two endpoints show in any order.
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
  if (reader) {
    gateway.registry.reader_seen(reader_of(pair->instance), {instance.identity, pair->instance});
    gateway.matched.insert(reader_of(pair->instance));
    static_cast<void>(gateway.requests[instance.identity.uuid]);
    side.reader = true;
  } else {
    gateway.registry.writer_seen(writer_of(pair->instance), {instance.identity.id, pair->instance});
    gateway.matched.insert(writer_of(pair->instance));
    if (!side.writer) {
      side.writer = true;
      pair->replies = 0;
    }
  }
  look_around(pair->gateway);
  send_requests(pair);
  send_replies(pair);
}

void Fabric::lose(const PairPointer& pair, bool of_instance) {
  lose_known(pair, of_instance);
}

void Fabric::lose_known(const PairPointer& pair, bool of_instance) {
  Side& side = of_instance ? pair->of_instance : pair->of_gateway;
  side.reader = false;
  side.writer = false;
  if (!of_instance) {
    // What was not taken has no writer any more and is passed over.
    for (auto& [key, cached] : ends_[pair->instance]->requests_in) {
      if (cached.from == pair->gateway) {
        cached.value.reset();
      }
    }
    pair->requests = 0;
    return;
  }
  End& gateway = *ends_[pair->gateway];
  gateway.registry.endpoint_gone(reader_of(pair->instance));
  gateway.registry.endpoint_gone(writer_of(pair->instance));
  gateway.matched.erase(reader_of(pair->instance));
  gateway.matched.erase(writer_of(pair->instance));
  pair->replies = 0;
  look_around(pair->gateway);
}

void Fabric::look_around(EndNumber number) {
  End& end = *ends_[number];
  if (end.discovery_due || !end.there) {
    return;
  }
  end.discovery_due = true;
  agenda_.after(random_.between(Time{}, 500us), {.parties = end.process->parties()},
                [this, number, &end] {
                  end.process->run(end.life, [this, number] { take_changes(number); });
                });
}

void Fabric::take_changes(EndNumber number) {
  End& end = *ends_[number];
  end.discovery_due = false;
  end.registry.set_matched(end.matched);
  // An instance that leaves may have answered just before.
  take_replies(number);
  const auto changes = end.registry.changes();
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

bool Fabric::publish(EndNumber number, const fabric::Request& request) {
  End& end = *ends_[number];
  const auto writer = end.requests.find(fabric::canonical_uuid(request.uuid));
  if (writer == end.requests.end()) {
    return false;
  }
  writer->second.samples[request.key] = {++writer->second.last, request};
  for (const PairPointer& pair : pairs_of(number)) {
    send_requests(pair);
  }
  return true;
}

void Fabric::withdraw(EndNumber number, const Key& key, const std::string& uuid) {
  End& end = *ends_[number];
  const auto writer = end.requests.find(fabric::canonical_uuid(uuid));
  if (writer == end.requests.end()) {
    return;
  }
  const auto sample = writer->second.samples.find(key);
  if (sample == writer->second.samples.end() || !sample->second.value) {
    return;
  }
  sample->second = {++writer->second.last, std::nullopt};
  for (const PairPointer& pair : pairs_of(number)) {
    send_requests(pair);
  }
}

void Fabric::publish(EndNumber number, const fabric::Reply& reply) {
  Writer<fabric::Reply>& writer = ends_[number]->replies;
  writer.samples[reply.key] = {++writer.last, reply};
  for (const PairPointer& pair : pairs_of(number)) {
    send_replies(pair);
  }
}

void Fabric::change_identity(EndNumber number, const fabric::InstanceIdentity& identity) {
  ends_[number]->identity = identity;
  for (const PairPointer& pair : pairs_of(number)) {
    within(pair, delay(false), [this, pair] {
      if (pair->of_instance.reader && pair->of_instance.heard) {
        discover(pair, true);
      }
    });
  }
}

void Fabric::send_requests(const PairPointer& pair, bool again) {
  if (!std::exchange(pair->requests_due, true)) {
    within(pair, delay(again), [this, pair] {
      pair->requests_due = false;
      arrive_requests(pair);
    });
  }
}

void Fabric::send_replies(const PairPointer& pair, bool again) {
  if (!std::exchange(pair->replies_due, true)) {
    within(pair, delay(again), [this, pair] {
      pair->replies_due = false;
      arrive_replies(pair);
    });
  }
}

void Fabric::arrive_requests(const PairPointer& pair) {
  End& gateway = *ends_[pair->gateway];
  End& instance = *ends_[pair->instance];
  if (!gateway.there || !instance.there || !pair->of_instance.reader || !pair->of_gateway.reader ||
      !pair->of_gateway.heard) {
    return;
  }
  const auto writer = gateway.requests.find(instance.identity.uuid);
  if (writer == gateway.requests.end()) {
    return;
  }
  const bool fresh = pair->requests == 0;
  bool news = false;
  for (auto& [key, sample] : writer->second.samples) {
    if (sample.number <= pair->requests || (fresh && !sample.value)) {
      continue;
    }
    Cached<fabric::Request>& cached = instance.requests_in[key];
    cached.withdrawn = !sample.value;
    cached.from = pair->gateway;
    if (sample.value) {
      cached.value = sample.value;
    }
    news = true;
  }
  pair->requests = writer->second.last;
  if (news && !std::exchange(instance.drain_due, true)) {
    agenda_.after(random_.between(Time{}, 300us), {.parties = instance.process->parties()},
                  [this, number = pair->instance] {
                    End& end = *ends_[number];
                    end.process->run(end.life, [this, number] { take_requests(number); });
                  });
  }
}

void Fabric::take_requests(EndNumber number) {
  End& end = *ends_[number];
  end.drain_due = false;
  for (const auto& [key, cached] : std::exchange(end.requests_in, {})) {
    if (cached.withdrawn) {
      // Its request may be here too, untaken: whoever withdraws overtakes it.
      end.instance->on_withdrawn(key);
    } else if (cached.value) {
      end.instance->on_request(*cached.value);
    }
  }
}

void Fabric::arrive_replies(const PairPointer& pair) {
  End& gateway = *ends_[pair->gateway];
  End& instance = *ends_[pair->instance];
  if (!gateway.there || !pair->of_instance.writer || !pair->of_gateway.writer ||
      !pair->of_instance.heard) {
    return;
  }
  bool news = false;
  for (auto& [key, sample] : instance.replies.samples) {
    if (sample.number > pair->replies) {
      gateway.replies_in[{key, instance.identity.id}] = *sample.value;
      news = true;
    }
  }
  pair->replies = instance.replies.last;
  if (news) {
    agenda_.after(random_.between(Time{}, 300us), {.parties = gateway.process->parties()},
                  [this, number = pair->gateway] {
                    End& end = *ends_[number];
                    end.process->run(end.life, [this, number] { take_replies(number); });
                  });
  }
}

void Fabric::take_replies(EndNumber number) {
  End& end = *ends_[number];
  for (const auto& [key, reply] : std::exchange(end.replies_in, {})) {
    end.gateway->on_reply(reply);
  }
}

}  // namespace millrace::tests::simulation
