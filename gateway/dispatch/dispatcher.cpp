#include "gateway/dispatch/dispatcher.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <tuple>

#include <fmt/format.h>

#include "gateway/dispatch/near_miss.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::dispatch {

namespace {

/// How closely an instance's scope names a channel: 0 = any channel will do, up to 3 = machine and
/// channel; nothing if the channel is out of its scope.
std::optional<int> closeness(const fabric::InstanceIdentity& identity,
                             const fabric::ChannelKey& key) {
  if (identity.channels.empty()) {
    return 0;
  }
  std::optional<int> best;
  for (const fabric::ChannelScope& scope : identity.channels) {
    const bool machine_fits = scope.machine.empty() || scope.machine == key.machine;
    const bool channel_fits = scope.channel == 0 || scope.channel == key.channel;
    if (machine_fits && channel_fits) {
      const int named = (scope.channel != 0 ? 2 : 0) + (scope.machine.empty() ? 0 : 1);
      best = std::max(best.value_or(0), named);
    }
  }
  return best;
}

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
  Instance& instance = instances_[identity.id];
  const bool back = instance.identity.id != identity.id || instance.lost_at.has_value();
  instance.identity = identity;
  instance.lost_at.reset();
  instance.seen = true;
  Decisions decisions;
  if (back) {
    give_again(instance, decisions);
  }
  give_out(decisions);
  return decisions;
}

Decisions Dispatcher::on_instance_gone(const fabric::InstanceId& instance, SteadyTime now) {
  Decisions decisions;
  if (const auto found = instances_.find(instance); found != instances_.end()) {
    found->second.lost_at = now + options_.grace;
    give_out(decisions);
  }
  return decisions;
}

Decisions Dispatcher::on_time(SteadyTime now) {
  Decisions decisions;
  for (auto it = instances_.begin(); it != instances_.end();) {
    if (it->second.lost_at && *it->second.lost_at <= now) {
      lose(it->second, decisions);
      it = instances_.erase(it);
    } else {
      ++it;
    }
  }
  give_out(decisions);
  return decisions;
}

std::optional<SteadyTime> Dispatcher::next_time() const {
  constexpr SteadyTime never = SteadyTime::max();
  SteadyTime next = never;
  for (const auto& [id, instance] : instances_) {
    next = std::min(next, instance.lost_at.value_or(never));
  }
  return next == never ? std::nullopt : std::optional(next);
}

std::optional<std::string> Dispatcher::why_unserved(const std::string& uuid,
                                                    const fabric::ChannelKey& key) const {
  const std::string wanted = fabric::canonical_uuid(uuid);
  std::string elsewhere;
  bool draining = false;
  for (const auto& [id, instance] : instances_) {
    if (instance.identity.uuid != wanted || !instance.seen) {
      continue;
    }
    if (!closeness(instance.identity, key)) {
      elsewhere = scope_of(instance.identity);
    } else if (instance.identity.draining) {
      draining = true;
    } else {
      return {};
    }
  }
  if (draining) {
    return fmt::format("V.G.SERVICE.UUID {}: its instances are draining and take nothing new",
                       printable(uuid));
  }
  if (!elsewhere.empty()) {
    return fmt::format("V.G.SERVICE.UUID {} is served for {}, not for {}", printable(uuid),
                       elsewhere, key.to_string());
  }
  return explain_unserved(uuid, known_uuids());
}

fabric::Delivery Dispatcher::delivery_of(const std::string& uuid) const {
  const bool once = std::ranges::any_of(instances_, [&](const auto& one) {
    return one.second.identity.uuid == uuid &&
           one.second.identity.delivery == fabric::Delivery::at_most_once;
  });
  return once ? fabric::Delivery::at_most_once : fabric::Delivery::at_least_once;
}

Decisions Dispatcher::add(const Call& call) {
  const bool again = index_.contains(call.id);
  forget(call.id);
  Job job;
  job.call = call.id;
  job.key = call.key;
  job.uuid = fabric::canonical_uuid(call.request.uuid);
  job.attempts = call.attempts.empty() ? 0 : call.attempts.back().number;
  Job& entered = enter(std::move(job));
  Decisions decisions;
  if (again) {
    // Its instance has room for another one.
    give_out(decisions);
  } else {
    // Nothing that has waited longer can be given now, or it would have been.
    try_to_give(entered, decisions);
  }
  return decisions;
}

Decisions Dispatcher::resume(const Call& call, SteadyTime now) {
  if (index_.contains(call.id)) {
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
  job.given = true;
  job.delivery = call.delivery;
  enter(job);
  Decisions decisions;
  auto [it, unknown] = instances_.try_emplace(last.instance);
  Instance& instance = it->second;
  ++instance.running;
  if (unknown) {
    instance.identity.id = last.instance;
    instance.identity.uuid = job.uuid;
    instance.lost_at = now + options_.rejoin;
    instance.seen = false;
  } else if (!instance.lost_at) {
    decisions.emplace_back(
        Give{job.call, job.key, Assignment{last, job.delivery, name_of(instance.identity)}});
  }
  give_out(decisions);
  return decisions;
}

Decisions Dispatcher::remove(const fabric::CallId& call) {
  Decisions decisions;
  const auto found = index_.find(call);
  if (found == index_.end()) {
    return decisions;
  }
  const auto job = found->second;
  const auto instance = job->given ? instances_.find(job->instance) : instances_.end();
  forget(call);
  if (instance != instances_.end()) {
    fill(instance->second, decisions);
  }
  return decisions;
}

Dispatcher::Job& Dispatcher::enter(Job job) {
  job.number = ++entered_;
  jobs_.push_back(std::move(job));
  index_.emplace(jobs_.back().call, std::prev(jobs_.end()));
  note(jobs_.back());
  return jobs_.back();
}

void Dispatcher::note(Job& job) {
  if (!job.given && !job.held) {
    waiting_.emplace(job.number, &job);
  } else {
    waiting_.erase(job.number);
  }
}

void Dispatcher::forget(const fabric::CallId& call) {
  const auto entry = index_.find(call);
  if (entry == index_.end()) {
    return;
  }
  const auto job = entry->second;
  if (const auto found = instances_.find(job->instance); job->given && found != instances_.end()) {
    --found->second.running;
  }
  waiting_.erase(job->number);
  index_.erase(entry);
  jobs_.erase(job);
}

void Dispatcher::give_out(Decisions& decisions) {
  for (auto next = waiting_.begin(); next != waiting_.end();) {
    // It waits no more if it is given.
    Job& job = *(next++)->second;
    try_to_give(job, decisions);
  }
}

void Dispatcher::try_to_give(Job& job, Decisions& decisions) {
  if (Instance* instance = choose(job)) {
    give(job, *instance, decisions);
  } else if (std::string reason = why_waiting(job); reason != job.reason) {
    job.reason = std::move(reason);
    decisions.emplace_back(Explain{job.call, job.key, job.reason});
  }
}

void Dispatcher::fill(Instance& instance, Decisions& decisions) {
  const fabric::InstanceIdentity& identity = instance.identity;
  if (identity.draining || instance.lost_at) {
    return;
  }
  for (auto next = waiting_.begin(); next != waiting_.end();) {
    if (instance.running >= std::max(1U, identity.concurrency)) {
      return;
    }
    Job& job = *(next++)->second;
    if (job.uuid == identity.uuid && closeness(identity, job.key)) {
      give(job, instance, decisions);
    }
  }
}

void Dispatcher::give(Job& job, Instance& instance, Decisions& decisions) {
  ++job.attempts;
  job.instance = instance.identity.id;
  job.given = true;
  note(job);
  job.delivery = instance.identity.delivery;
  job.reason.clear();
  ++instance.running;
  instance.last_used = ++given_;
  decisions.emplace_back(Give{
      job.call, job.key,
      Assignment{Attempt{job.instance, job.attempts}, job.delivery, name_of(instance.identity)}});
}

void Dispatcher::give_again(Instance& instance, Decisions& decisions) {
  for (Job& job : jobs_) {
    const bool lost_here = job.held && job.delivery == fabric::Delivery::at_most_once;
    if (job.instance != instance.identity.id || !(job.given || lost_here)) {
      continue;
    }
    if (!job.given) {
      job.given = true;
      job.held = false;
      note(job);
      ++instance.running;
    }
    decisions.emplace_back(Give{
        job.call, job.key,
        Assignment{Attempt{job.instance, job.attempts}, job.delivery, name_of(instance.identity)}});
  }
}

void Dispatcher::lose(const Instance& instance, Decisions& decisions) {
  const std::string name = name_of(instance.identity);
  for (Job& job : jobs_) {
    if (!job.given || job.instance != instance.identity.id) {
      continue;
    }
    job.given = false;
    job.held = job.delivery == fabric::Delivery::at_most_once;
    note(job);
    job.reason = job.held ? fmt::format(
                                "{} is lost with this call, which must not run twice; an "
                                "operator must answer or retry it",
                                name)
                          : fmt::format("{} is lost; the call goes to another instance", name);
    decisions.emplace_back(TakeBack{job.call, job.key, job.reason, job.held});
  }
}

Dispatcher::Instance* Dispatcher::choose(const Job& job) {
  Instance* best = nullptr;
  std::tuple<int, std::uint32_t, std::uint64_t> best_rank;
  for (auto& [id, instance] : instances_) {
    const fabric::InstanceIdentity& identity = instance.identity;
    const auto close = closeness(identity, job.key);
    if (identity.uuid != job.uuid || !close || identity.draining || instance.lost_at ||
        instance.running >= std::max(1U, identity.concurrency)) {
      continue;
    }
    const std::tuple rank(-*close, instance.running, instance.last_used);
    if (best == nullptr || rank < best_rank) {
      best = &instance;
      best_rank = rank;
    }
  }
  return best;
}

std::string Dispatcher::why_waiting(const Job& job) const {
  std::size_t busy = 0;
  for (const auto& [id, instance] : instances_) {
    const fabric::InstanceIdentity& identity = instance.identity;
    if (identity.uuid == job.uuid && closeness(identity, job.key) && !identity.draining &&
        !instance.lost_at) {
      ++busy;
    }
  }
  if (busy == 0) {
    return fmt::format("no instance of {} is ready for {}", printable(job.uuid),
                       job.key.to_string());
  }
  return busy == 1 ? std::string("the only instance is busy")
                   : fmt::format("all {} instances are busy", busy);
}

std::vector<std::string> Dispatcher::known_uuids() const {
  std::set<std::string> uuids;
  for (const auto& [id, instance] : instances_) {
    uuids.insert(instance.identity.uuid);
  }
  return {uuids.begin(), uuids.end()};
}

}  // namespace millrace::gateway::dispatch
