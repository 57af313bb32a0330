#include "gateway/dispatch/dispatcher.hpp"

#include <algorithm>
#include <set>
#include <span>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/dispatch/near_miss.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::dispatch {

namespace {

/// After this number of declines without a response, announced room is ignored.
constexpr unsigned most_declined = 8;

std::string name_of(const fabric::InstanceIdentity& identity) {
  if (identity.name.empty()) {
    return fmt::format("instance {}", identity.id.to_string());
  }
  return fmt::format("{} (pid {} on {})", identity.name, identity.pid, identity.host);
}

/// Without an instance.
PendingCall pending_of(std::shared_ptr<const CallRecord> call) {
  PendingCall pending{.uuid = fabric::canonical_uuid(call->request.uuid)};
  pending.assignment.attempt = call->attempts.empty() ? Attempt{{}, 0} : call->attempts.back();
  pending.assignment.delivery = call->delivery;
  pending.assignment.completion_signal = call->completion_signal;
  pending.record = std::move(call);
  return pending;
}

std::string scope_of(const fabric::InstanceIdentity& identity) {
  std::string words;
  for (const fabric::ChannelScope& scope : identity.channels) {
    words += fmt::format("{}{}/{}", words.empty() ? "" : ", ",
                         scope.machine.empty() ? "*" : scope.machine,
                         scope.channel == 0 ? "*" : std::to_string(scope.channel));
  }
  return words;
}

}  // namespace

Decisions Dispatcher::on_instance_ready(const fabric::InstanceIdentity& identity) {
  Instance* const known = instances_.find(identity.id);
  const bool back = known == nullptr || known->lost_at.has_value();
  const std::string before = known != nullptr ? known->identity.uuid : identity.uuid;
  Instance& instance = instances_.enter(identity.id);
  instances_.change(instance, [&] {
    instance.identity = identity;
    instance.name = std::make_shared<const std::string>(name_of(identity));
    instance.lost_at.reset();
    instance.seen = true;
    if (back) {
      instance.load.others = 0;
    }
  });
  Decisions decisions;
  if (back) {
    assign_again(instance, decisions);
  }
  assign_waiting(identity.uuid, decisions);
  if (before != identity.uuid) {
    assign_waiting(before, decisions);
  }
  return decisions;
}

Decisions Dispatcher::on_instance_gone(const fabric::InstanceId& id, SteadyTime now) {
  Decisions decisions;
  if (Instance* const instance = instances_.find(id)) {
    instances_.change(*instance, [&] { instance->lost_at = now + options_.grace; });
    assign_waiting(instance->identity.uuid, decisions);
  }
  return decisions;
}

Decisions Dispatcher::on_load(const fabric::InstanceLoad& load, SteadyTime now) {
  Decisions decisions;
  Instance* const instance = instances_.find(load.status.instance);
  if (instance == nullptr) {
    return decisions;
  }
  std::uint32_t others = 0;
  for (const fabric::CallId& call : load.calls) {
    const PendingCall* const pending = calls_.find(call);
    others += pending == nullptr || pending->at != instance ? 1U : 0U;
  }
  const std::size_t running =
      load.calls.size() - std::min<std::size_t>(load.calls.size(), load.status.waiting);
  const auto begun = std::span(load.calls).first(running);
  std::vector<PendingCall*> unheard;
  Instances::change_load(*instance, [&](Load& known) {
    known.others = others;
    for (PendingCall* const pending : instance->calls) {
      bool& waits = pending->assignment.waits;
      waits = waits && std::ranges::count(begun, pending->id()) == 0;
      const bool due =
          pending->published.at && now - *pending->published.at >= options_.unresponsive;
      pending->published.unknown = due && std::ranges::count(load.calls, pending->id()) == 0
                                       ? pending->published.unknown + 1
                                       : 0;
      if (pending->published.unknown >= 2) {
        unheard.push_back(pending);
      }
    }
    PendingCalls::note_waiters(*instance);
  });
  if (instance->busy_until && instance->declined < most_declined) {
    // Its present calls are known.
    instances_.change(*instance, [&] { instance->busy_until.reset(); });
  }
  if (!unheard.empty()) {
    instances_.change(*instance,
                      [&] { instance->unresponsive_until = now + options_.unresponsive_pause; });
    std::ranges::sort(unheard, {}, &PendingCall::number);
    for (PendingCall* const pending : unheard) {
      lose_call(*pending, Loss::unresponsive, decisions);
    }
  }
  if (!unheard.empty() || instance->has_place()) {
    assign_waiting(instance->identity.uuid, decisions);
  }
  return decisions;
}

void Dispatcher::on_published(const fabric::CallId& call, SteadyTime now) {
  if (PendingCall* const pending = calls_.find(call)) {
    pending->published.at = now;
    pending->published.unknown = 0;
  }
}

Decisions Dispatcher::decline(const fabric::CallId& call, SteadyTime now) {
  Decisions decisions;
  PendingCall* const pending = calls_.find(call);
  if (pending == nullptr || pending->at == nullptr) {
    return decisions;
  }
  Instance& instance = *pending->at;
  calls_.queue(*pending);
  instances_.change(instance, [&] {
    ++instance.declined;
    instance.busy_until = now + (instance.declined < most_declined ? options_.busy_pause
                                                                   : options_.unresponsive_pause);
  });
  try_to_assign(*pending, decisions);
  return decisions;
}

Decisions Dispatcher::on_time(SteadyTime now) {
  Decisions decisions;
  std::set<std::string> changed;
  while (Instance* const instance = instances_.alarmed(now)) {
    changed.insert(instance->identity.uuid);
    if (instance->lost_at && *instance->lost_at <= now) {
      lose(*instance, decisions);
      continue;
    }
    instances_.change(*instance, [&] {
      for (auto* const until : {&instance->busy_until, &instance->unresponsive_until}) {
        if (*until && **until <= now) {
          until->reset();
        }
      }
    });
  }
  for (const std::string& uuid : changed) {
    assign_waiting(uuid, decisions);
  }
  return decisions;
}

bool Dispatcher::serves(const std::string& canonical_uuid, const fabric::ChannelKey& key) const {
  return instances_.service(canonical_uuid, key).served;
}

std::optional<fabric::Message> Dispatcher::why_unserved(const std::string& uuid,
                                                        const fabric::ChannelKey& key) const {
  const Instances::Service service = instances_.service(fabric::canonical_uuid(uuid), key);
  if (service.served) {
    return {};
  }
  if (service.draining) {
    return base::messages::service_draining(printable(uuid));
  }
  if (service.elsewhere != nullptr) {
    return base::messages::other_channels(printable(uuid), scope_of(service.elsewhere->identity),
                                          key.to_string());
  }
  const auto last = last_of_.find(fabric::canonical_uuid(uuid));
  if (last == last_of_.end()) {
    return explain_unserved(uuid, instances_.uuids());
  }
  return base::messages::no_instance(printable(uuid), last->second);
}

fabric::Delivery Dispatcher::delivery_of(const std::string& uuid) const {
  return instances_.any_at_most_once(uuid) ? fabric::Delivery::at_most_once
                                           : fabric::Delivery::at_least_once;
}

Decisions Dispatcher::add(std::shared_ptr<const CallRecord> call) {
  PendingCall* const before = calls_.find(call->id);
  const bool again = before != nullptr;
  if (again) {
    calls_.forget(*before);
  }
  PendingCall& entered = calls_.enter(pending_of(std::move(call)));
  Decisions decisions;
  if (again) {
    // Its instance has room for another one.
    calls_.queue(entered);
    assign_waiting(entered.uuid, decisions);
  } else {
    // No earlier call can be dispatched now, or it would have been.
    try_to_assign(entered, decisions);
  }
  return decisions;
}

Decisions Dispatcher::resume(std::shared_ptr<const CallRecord> call, SteadyTime now) {
  if (calls_.find(call->id) != nullptr) {
    // An operator had it dispatched again before its channel was seen.
    return {};
  }
  PendingCall& entered = calls_.enter(pending_of(std::move(call)));
  Decisions decisions;
  Instance* instance = instances_.find(entered.assignment.attempt.instance);
  if (instance == nullptr) {
    instance = &instances_.enter(entered.assignment.attempt.instance);
    instances_.change(*instance, [&] {
      instance->identity.uuid = entered.uuid;
      instance->name = std::make_shared<const std::string>(name_of(instance->identity));
      instance->lost_at = now + options_.rejoin;
      instance->seen = false;
    });
  }
  entered.assignment.name = instance->name;
  calls_.assign(entered, *instance);
  if (!instance->lost_at) {
    decisions.emplace_back(Assign{entered.id(), entered.key(), entered.assignment});
  }
  assign_waiting(entered.uuid, decisions);
  return decisions;
}

Decisions Dispatcher::remove(const fabric::CallId& call) {
  Decisions decisions;
  PendingCall* const pending = calls_.find(call);
  if (pending == nullptr) {
    return decisions;
  }
  Instance* const instance = pending->at;
  calls_.forget(*pending);
  if (instance != nullptr) {
    instance->declined = 0;
    fill(*instance, decisions);
  }
  return decisions;
}

void Dispatcher::assign_waiting(const std::string& uuid, Decisions& decisions) {
  const PendingCalls::Queue* const queue = calls_.waiting(uuid);
  if (queue == nullptr) {
    return;
  }
  // The queue goes with its last call, and a call leaves it when it is given.
  std::vector<PendingCall*> waiting;
  waiting.reserve(queue->size());
  for (const auto& [number, pending] : *queue) {
    waiting.push_back(pending);
  }
  for (PendingCall* const pending : waiting) {
    try_to_assign(*pending, decisions);
  }
}

void Dispatcher::try_to_assign(PendingCall& pending, Decisions& decisions) {
  if (Instance* const instance =
          instances_.choose(&ScopeGroup::with_room, pending.uuid, pending.key())) {
    assign(pending, *instance, decisions);
  } else if (Instance* const busy =
                 instances_.choose(&ScopeGroup::shared, pending.uuid, pending.key())) {
    pending.assignment.waits = true;
    assign(pending, *busy, decisions);
  } else {
    calls_.queue(pending);
    if (fabric::Message reason = why_waiting(pending); reason != pending.reason) {
      pending.reason = std::move(reason);
      decisions.emplace_back(Explain{pending.id(), pending.key(), pending.reason});
    }
  }
}

void Dispatcher::fill(Instance& instance, Decisions& decisions) {
  if (instance.identity.draining || instance.lost_at || instance.unresponsive_until) {
    return;
  }
  while (instance.has_room()) {
    const PendingCalls::Queue* const queue = calls_.waiting(instance.identity.uuid);
    if (queue == nullptr) {
      return;
    }
    const auto next = std::ranges::find_if(*queue, [&](const auto& waiting) {
      return Instances::serves(instance.identity, waiting.second->key());
    });
    if (next == queue->end()) {
      return;
    }
    assign(*next->second, instance, decisions);
  }
}

void Dispatcher::assign(PendingCall& pending, Instance& instance, Decisions& decisions) {
  const fabric::InstanceIdentity& identity = instance.identity;
  Assignment assignment{{identity.id, pending.assignment.attempt.number + 1},
                        identity.delivery,
                        instance.name,
                        pending.assignment.waits,
                        identity.completion_signal};
  pending.reason = {};
  calls_.assign(pending, instance);
  pending.assignment = std::move(assignment);
  Instances::change_load(instance, [&](Load& load) {
    instances_.use(instance, pending.key());
    load.has_waiter = load.has_waiter || pending.assignment.waits;
  });
  decisions.emplace_back(Assign{pending.id(), pending.key(), pending.assignment});
}

void Dispatcher::assign_again(Instance& instance, Decisions& decisions) {
  std::vector<PendingCall*> lost_here;
  for (const auto& [number, pending] : calls_.held()) {
    if (pending->assignment.attempt.instance == instance.identity.id) {
      lost_here.push_back(pending);
    }
  }
  for (PendingCall* const pending : lost_here) {
    calls_.assign(*pending, instance);
  }
  std::ranges::sort(instance.calls, {}, &PendingCall::number);
  for (PendingCall* const pending : instance.calls) {
    pending->assignment.name = instance.name;
    decisions.emplace_back(Assign{pending->id(), pending->key(), pending->assignment});
  }
}

void Dispatcher::lose(Instance& instance, Decisions& decisions) {
  std::vector<PendingCall*> calls = instance.calls;
  std::ranges::sort(calls, {}, &PendingCall::number);
  for (PendingCall* const pending : calls) {
    lose_call(*pending, Loss::gone, decisions);
  }
  // A stranger can announce any number of UUIDs.
  constexpr std::size_t most_remembered = 256;
  const std::string& uuid = instance.identity.uuid;
  if (instance.seen && (last_of_.size() < most_remembered || last_of_.contains(uuid))) {
    last_of_.insert_or_assign(uuid, name_of(instance.identity));
  }
  instances_.erase(instance);
}

void Dispatcher::lose_call(PendingCall& pending, Loss loss, Decisions& decisions) {
  const std::string name = *pending.at->name;
  const bool held = pending.assignment.delivery == fabric::Delivery::at_most_once;
  held ? calls_.hold(pending) : calls_.queue(pending);
  pending.reason = loss == Loss::gone ? held ? base::messages::instance_lost_held(name)
                                             : base::messages::instance_lost(name)
                   : held ? base::messages::instance_deaf_held(name)
                                      : base::messages::instance_deaf(name);
  decisions.emplace_back(Unassign{pending.id(), pending.key(), pending.reason, held});
}

fabric::Message Dispatcher::why_waiting(const PendingCall& pending) const {
  const std::size_t busy = instances_.ready(pending.uuid, pending.key());
  if (busy == 0) {
    return base::messages::no_instance_ready(printable(pending.uuid), pending.key().to_string());
  }
  return busy == 1 ? base::messages::only_instance_busy() : base::messages::instances_busy(busy);
}

}  // namespace millrace::gateway::dispatch
