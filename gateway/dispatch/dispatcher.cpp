#include "gateway/dispatch/dispatcher.hpp"

#include <algorithm>
#include <set>
#include <span>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/dispatch/near_miss.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::dispatch {

namespace {

/// Who declines so often without an answer in between is not believed when he says he has room.
constexpr unsigned most_declined = 8;

std::string name_of(const fabric::InstanceIdentity& identity) {
  if (identity.name.empty()) {
    return fmt::format("instance {}", identity.id.to_string());
  }
  return fmt::format("{} (pid {} on {})", identity.name, identity.pid, identity.host);
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
      instance.others = 0;
    }
  });
  Decisions decisions;
  if (back) {
    give_again(instance, decisions);
  }
  give_out(identity.uuid, decisions);
  if (before != identity.uuid) {
    give_out(before, decisions);
  }
  return decisions;
}

Decisions Dispatcher::on_instance_gone(const fabric::InstanceId& id, SteadyTime now) {
  Decisions decisions;
  if (Instance* const instance = instances_.find(id)) {
    instances_.change(*instance, [&] { instance->lost_at = now + options_.grace; });
    give_out(instance->identity.uuid, decisions);
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
    const Job* const job = jobs_.find(call);
    others += job == nullptr || job->at != instance ? 1U : 0U;
  }
  const std::size_t running =
      load.calls.size() - std::min<std::size_t>(load.calls.size(), load.status.waiting);
  const auto begun = std::span(load.calls).first(running);
  std::vector<Job*> unheard;
  Instances::change_load(*instance, [&] {
    instance->others = others;
    for (Job* const job : instance->jobs) {
      job->waits = job->waits && std::ranges::count(begun, job->call) == 0;
      const bool due = job->published_at && now - *job->published_at >= options_.deaf;
      job->unknown = due && std::ranges::count(load.calls, job->call) == 0 ? job->unknown + 1 : 0;
      if (job->unknown >= 2) {
        unheard.push_back(job);
      }
    }
    Jobs::note_waiters(*instance);
  });
  if (instance->full_until && instance->declined < most_declined) {
    // What it has now is known.
    instances_.change(*instance, [&] { instance->full_until.reset(); });
  }
  if (!unheard.empty()) {
    instances_.change(*instance, [&] { instance->deaf_until = now + options_.deaf_pause; });
    std::ranges::sort(unheard, {}, &Job::number);
    for (Job* const job : unheard) {
      lose_call(*job, Loss::deaf, decisions);
    }
  }
  if (!unheard.empty() || instance->has_place()) {
    give_out(instance->identity.uuid, decisions);
  }
  return decisions;
}

void Dispatcher::on_published(const fabric::CallId& call, SteadyTime now) {
  if (Job* const job = jobs_.find(call)) {
    job->published_at = now;
    job->unknown = 0;
  }
}

Decisions Dispatcher::decline(const fabric::CallId& call, SteadyTime now) {
  Decisions decisions;
  Job* const job = jobs_.find(call);
  if (job == nullptr || job->at == nullptr) {
    return decisions;
  }
  Instance& instance = *job->at;
  jobs_.queue(*job);
  instances_.change(instance, [&] {
    ++instance.declined;
    instance.full_until =
        now + (instance.declined < most_declined ? options_.full_pause : options_.deaf_pause);
  });
  try_to_give(*job, decisions);
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
      for (auto* const until : {&instance->full_until, &instance->deaf_until}) {
        if (*until && **until <= now) {
          until->reset();
        }
      }
    });
  }
  for (const std::string& uuid : changed) {
    give_out(uuid, decisions);
  }
  return decisions;
}

bool Dispatcher::serves(const std::string& canonical_uuid, const fabric::ChannelKey& key) const {
  return instances_.service(canonical_uuid, key).served;
}

std::optional<std::string> Dispatcher::why_unserved(const std::string& uuid,
                                                    const fabric::ChannelKey& key) const {
  const Instances::Service service = instances_.service(fabric::canonical_uuid(uuid), key);
  if (service.served) {
    return {};
  }
  // It is no program that says who gets the messages of a queue, or the call of a command
  // ("call.7f3a").
  constexpr std::string_view variable = "V.G.SERVICE.UUID";
  const std::string_view subject = fabric::queue_of(key.machine).empty() ? variable : "uuid";
  if (service.draining) {
    return fmt::format("{} {}: its instances are draining and take nothing new", subject,
                       printable(uuid));
  }
  if (service.elsewhere != nullptr) {
    return fmt::format("{} {} is served for {}, not for {}", subject, printable(uuid),
                       scope_of(service.elsewhere->identity), key.to_string());
  }
  const auto last = last_of_.find(fabric::canonical_uuid(uuid));
  std::string why = last == last_of_.end()
                        ? explain_unserved(uuid, instances_.uuids())
                        : fmt::format("{} {} is served by nobody; its last instance was {}",
                                      variable, printable(uuid), last->second);
  if (why.starts_with(variable)) {
    why.replace(0, variable.size(), subject);
  }
  return why;
}

fabric::Delivery Dispatcher::delivery_of(const std::string& uuid) const {
  return instances_.any_at_most_once(uuid) ? fabric::Delivery::at_most_once
                                           : fabric::Delivery::at_least_once;
}

Decisions Dispatcher::add(const Call& call) {
  Job* const before = jobs_.find(call.id);
  const bool again = before != nullptr;
  if (again) {
    jobs_.forget(*before);
  }
  Job job;
  job.call = call.id;
  job.key = call.key;
  job.uuid = fabric::canonical_uuid(call.request.uuid);
  job.attempts = call.attempts.empty() ? 0 : call.attempts.back().number;
  Job& entered = jobs_.enter(std::move(job));
  Decisions decisions;
  if (again) {
    // Its instance has room for another one.
    jobs_.queue(entered);
    give_out(entered.uuid, decisions);
  } else {
    // Nothing that has waited longer can be given now, or it would have been.
    try_to_give(entered, decisions);
  }
  return decisions;
}

Decisions Dispatcher::resume(const Call& call, SteadyTime now) {
  if (jobs_.find(call.id) != nullptr) {
    // An operator had it given out again before its channel was seen.
    return {};
  }
  const Attempt& last = call.attempts.back();
  Job job;
  job.call = call.id;
  job.key = call.key;
  job.uuid = fabric::canonical_uuid(call.request.uuid);
  job.attempts = last.number;
  job.instance = last.instance;
  job.delivery = call.delivery;
  job.awaited = call.awaited;
  Decisions decisions;
  Instance* instance = instances_.find(last.instance);
  if (instance == nullptr) {
    instance = &instances_.enter(last.instance);
    instances_.change(*instance, [&] {
      instance->identity.uuid = job.uuid;
      instance->name = std::make_shared<const std::string>(name_of(instance->identity));
      instance->lost_at = now + options_.rejoin;
      instance->seen = false;
    });
  }
  Job& entered = jobs_.enter(std::move(job));
  jobs_.hand_over(entered, *instance);
  if (!instance->lost_at) {
    decisions.emplace_back(assignment(entered, *instance));
  }
  give_out(entered.uuid, decisions);
  return decisions;
}

Decisions Dispatcher::remove(const fabric::CallId& call) {
  Decisions decisions;
  Job* const job = jobs_.find(call);
  if (job == nullptr) {
    return decisions;
  }
  Instance* const instance = job->at;
  jobs_.forget(*job);
  if (instance != nullptr) {
    instance->declined = 0;
    fill(*instance, decisions);
  }
  return decisions;
}

void Dispatcher::give_out(const std::string& uuid, Decisions& decisions) {
  const Jobs::Queue* const queue = jobs_.waiting(uuid);
  if (queue == nullptr) {
    return;
  }
  // The queue goes with its last call, and a call leaves it when it is given.
  std::vector<Job*> waiting;
  waiting.reserve(queue->size());
  for (const auto& [number, job] : *queue) {
    waiting.push_back(job);
  }
  for (Job* const job : waiting) {
    try_to_give(*job, decisions);
  }
}

void Dispatcher::try_to_give(Job& job, Decisions& decisions) {
  if (Instance* const instance = instances_.choose(job.uuid, job.key)) {
    give(job, *instance, decisions);
  } else if (Instance* const busy = instances_.choose_to_wait(job.uuid, job.key)) {
    job.waits = true;
    give(job, *busy, decisions);
  } else {
    jobs_.queue(job);
    if (std::string reason = why_waiting(job); reason != job.reason) {
      job.reason = std::move(reason);
      decisions.emplace_back(Explain{job.call, job.key, job.reason});
    }
  }
}

void Dispatcher::fill(Instance& instance, Decisions& decisions) {
  if (instance.identity.draining || instance.lost_at || instance.deaf_until) {
    return;
  }
  while (instance.has_room()) {
    const Jobs::Queue* const queue = jobs_.waiting(instance.identity.uuid);
    if (queue == nullptr) {
      return;
    }
    const auto next = std::ranges::find_if(*queue, [&](const auto& one) {
      return Instances::serves(instance.identity, one.second->key);
    });
    if (next == queue->end()) {
      return;
    }
    give(*next->second, instance, decisions);
  }
}

Give Dispatcher::assignment(const Job& job, const Instance& instance) {
  return {job.call, job.key,
          Assignment{Attempt{job.instance, job.attempts}, job.delivery, instance.name, job.waits,
                     job.awaited}};
}

void Dispatcher::give(Job& job, Instance& instance, Decisions& decisions) {
  ++job.attempts;
  job.instance = instance.identity.id;
  job.delivery = instance.identity.delivery;
  job.awaited = instance.identity.awaited;
  job.reason.clear();
  const bool waits = job.waits;
  jobs_.hand_over(job, instance);
  Instances::change_load(instance, [&] {
    job.waits = waits;
    instance.last_used = ++given_;
    Jobs::note_waiters(instance);
  });
  decisions.emplace_back(assignment(job, instance));
}

void Dispatcher::give_again(Instance& instance, Decisions& decisions) {
  std::vector<Job*> lost_here;
  for (const auto& [number, job] : jobs_.held()) {
    if (job->instance == instance.identity.id) {
      lost_here.push_back(job);
    }
  }
  for (Job* const job : lost_here) {
    jobs_.hand_over(*job, instance);
  }
  std::ranges::sort(instance.jobs, {}, &Job::number);
  for (const Job* const job : instance.jobs) {
    decisions.emplace_back(assignment(*job, instance));
  }
}

void Dispatcher::lose(Instance& instance, Decisions& decisions) {
  std::vector<Job*> jobs = instance.jobs;
  std::ranges::sort(jobs, {}, &Job::number);
  for (Job* const job : jobs) {
    lose_call(*job, Loss::gone, decisions);
  }
  // A stranger can announce any number of UUIDs.
  constexpr std::size_t most_remembered = 256;
  const std::string& uuid = instance.identity.uuid;
  if (instance.seen && (last_of_.size() < most_remembered || last_of_.contains(uuid))) {
    last_of_.insert_or_assign(uuid, name_of(instance.identity));
  }
  instances_.erase(instance);
}

void Dispatcher::lose_call(Job& job, Loss loss, Decisions& decisions) {
  const std::string name = *job.at->name;
  const std::string what = loss == Loss::gone ? "is lost" : "does not take what it is given";
  if (job.delivery == fabric::Delivery::at_most_once) {
    jobs_.hold(job);
  } else {
    jobs_.queue(job);
  }
  job.reason = job.held ? fmt::format(
                              "{} {} with this call, which must not run twice; an operator must "
                              "answer or retry it",
                              name, loss == Loss::gone ? "is lost" : "is deaf")
                        : fmt::format("{} {}; the call goes to another instance", name, what);
  decisions.emplace_back(TakeBack{job.call, job.key, job.reason, job.held});
}

std::string Dispatcher::why_waiting(const Job& job) const {
  const std::size_t busy = instances_.ready(job.uuid, job.key);
  if (busy == 0) {
    return fmt::format("no instance of {} is ready for {}", printable(job.uuid),
                       job.key.to_string());
  }
  return busy == 1 ? std::string("the only instance is busy")
                   : fmt::format("all {} instances are busy", busy);
}

}  // namespace millrace::gateway::dispatch
