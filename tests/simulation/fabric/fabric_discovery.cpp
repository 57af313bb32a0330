// Discovery and loss of ends.
#include <algorithm>
#include <utility>

#include "tests/simulation/fabric/fabric.hpp"

namespace millrace::tests::simulation {

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
  // Without calls it may be silent for longer.
  const Time longest = of_instance ? conditions.lease * 3 : conditions.lease;
  const Time wait = heard ? random_.between(conditions.discovery_least, conditions.discovery_most)
                          : random_.between(conditions.lease / 2, longest);
  agenda_.after(wait, {.parties = parties(*pair), .timer = true},
                [this, pair, &side, epoch, heard, of_instance] {
                  if (side.epoch == epoch) {
                    heard ? find(pair, of_instance) : lose_known(pair, of_instance);
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
    gateway.registry.writer_seen(writer_of(pair->instance), {instance.identity.id, pair->instance});
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
      if (pair->of_instance.reader && pair->of_instance.heard) {
        discover(pair, true);
      }
    });
  }
}

}  // namespace millrace::tests::simulation
