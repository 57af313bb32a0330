#include "gateway/dispatch/instances.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "fabric/channel_scope.hpp"

namespace millrace::gateway::dispatch {

namespace {

const fabric::ChannelScope any_channel{};

/// Without repeats; an instance that names none serves every channel.
std::vector<fabric::ChannelScope> scopes_of(const fabric::InstanceIdentity& identity) {
  if (identity.channels.empty()) {
    return {any_channel};
  }
  std::vector<fabric::ChannelScope> scopes = identity.channels;
  std::ranges::sort(scopes);
  scopes.erase(std::unique(scopes.begin(), scopes.end()), scopes.end());
  return scopes;
}

bool takes_calls(const Instance& instance) {
  return !instance.identity.draining && !instance.lost_at && !instance.unresponsive_until;
}

/// How many more calls than the least busy one an instance may have and keep its channels. It has
/// announced how many it runs at once, so a call does not wait for the others there.
std::uint32_t most_calls_ahead(const Instance& instance) {
  return instance.most() / 4;
}

ScopeGroup::Rank rank_of(const Instance& instance) {
  return {instance.load.total(), ~instance.load.last_used, instance.identity.id};
}

}  // namespace

/// Those that name the channel most closely come first; `visit` returns false to end.
template <typename Visit>
void Instances::visit_scope_groups(const Group& group, const fabric::ChannelKey& key, Visit visit) {
  const auto only = group.scope_groups.begin();
  if (group.scope_groups.size() == 1 && only->first == any_channel) {
    visit(only->second);
    return;
  }
  const auto visit_all = [&](const auto& scopes) {
    for (const fabric::ChannelScope& scope : scopes) {
      const auto found = group.scope_groups.find(scope);
      if (found != group.scope_groups.end() && !visit(found->second)) {
        return false;
      }
    }
    return true;
  };
  using Two = std::array<fabric::ChannelScope, 2>;
  using Four = std::array<fabric::ChannelScope, 4>;
  if (fabric::queue_of(key.machine).empty()) {
    visit_all(Four{{{key.machine, key.channel}, {"", key.channel}, {key.machine, 0}, any_channel}});
    return;
  }
  // A queue's calls are for those of its machine and channel too.
  const std::string machine(fabric::machine_of(key.machine));
  if (visit_all(Two{{{key.machine, key.channel}, {key.machine, 0}}})) {
    visit_all(Four{{{machine, key.channel}, {"", key.channel}, {machine, 0}, any_channel}});
  }
}

Instance* Instances::find(const fabric::InstanceId& id) {
  const auto found = instances_.find(id);
  return found == instances_.end() ? nullptr : &found->second;
}

Instance& Instances::enter(const fabric::InstanceId& id) {
  const auto [entry, made] = instances_.try_emplace(id);
  if (made) {
    entry->second.identity.id = id;
    list(entry->second);
  }
  return entry->second;
}

void Instances::erase(Instance& instance) {
  unlist(instance);
  instances_.erase(instance.identity.id);
}

void Instances::list(Instance& instance) {
  const fabric::InstanceIdentity& identity = instance.identity;
  if (const auto alarm = instance.alarm()) {
    alarms_.emplace(*alarm, identity.id);
  }
  Group& group = groups_[identity.uuid];
  const auto scopes = scopes_of(identity);
  group.members.emplace(identity.id, &instance);
  group.at_most_once += identity.delivery == fabric::Delivery::at_most_once ? 1U : 0U;
  group.repeated += scopes.size() > 1 ? 1U : 0U;
  for (const fabric::ChannelScope& scope : scopes) {
    ScopeGroup& scope_group = group.scope_groups[scope];
    instance.scope_groups.push_back(&scope_group);
    ++scope_group.all;
    scope_group.serving += instance.seen && !identity.draining ? 1U : 0U;
    scope_group.draining += instance.seen && identity.draining ? 1U : 0U;
    scope_group.ready += takes_calls(instance) ? 1U : 0U;
  }
  rank(instance);
}

void Instances::unlist(Instance& instance) {
  const fabric::InstanceIdentity& identity = instance.identity;
  if (const auto alarm = instance.alarm()) {
    alarms_.erase({*alarm, identity.id});
  }
  unrank(instance);
  const auto entry = groups_.find(identity.uuid);
  Group& group = entry->second;
  group.members.erase(identity.id);
  group.at_most_once -= identity.delivery == fabric::Delivery::at_most_once ? 1U : 0U;
  group.repeated -= instance.scope_groups.size() > 1 ? 1U : 0U;
  for (ScopeGroup* const scope_group : instance.scope_groups) {
    scope_group->serving -= instance.seen && !identity.draining ? 1U : 0U;
    scope_group->draining -= instance.seen && identity.draining ? 1U : 0U;
    scope_group->ready -= takes_calls(instance) ? 1U : 0U;
    --scope_group->all;
  }
  instance.scope_groups.clear();
  std::erase_if(group.scope_groups,
                [](const auto& scope_group) { return scope_group.second.all == 0; });
  if (group.members.empty()) {
    groups_.erase(entry);
  }
}

void Instances::rank(Instance& instance) {
  if (!takes_calls(instance)) {
    return;
  }
  for (ScopeGroup* const scope_group : instance.scope_groups) {
    if (instance.has_room()) {
      scope_group->with_room.emplace(rank_of(instance), &instance);
    } else if (instance.has_place() && !instance.busy_until && !instance.load.has_waiter) {
      scope_group->shared.emplace(rank_of(instance), &instance);
    }
  }
}

void Instances::unrank(const Instance& instance) {
  for (ScopeGroup* const scope_group : instance.scope_groups) {
    scope_group->with_room.erase(rank_of(instance));
    scope_group->shared.erase(rank_of(instance));
  }
}

const Instances::Group* Instances::group(const std::string& uuid) const {
  const auto found = groups_.find(uuid);
  return found == groups_.end() ? nullptr : &found->second;
}

/// `ranking` is not empty.
Instance* Instances::choose_in(const Group& group, const ScopeGroup::Ranking& ranking,
                               const fabric::ChannelKey& key) const {
  const auto least_busy = ranking.begin();
  const std::uint32_t load = std::get<0>(least_busy->first);
  if ((group.calls + 1) % calls_in_a_row == 0) {
    return std::prev(ranking.lower_bound({load + 1, 0, {}}))->second;
  }
  const auto last = group.last_instances.find(key);
  const auto user =
      last == group.last_instances.end() ? instances_.end() : instances_.find(last->second);
  if (user == instances_.end() ||
      user->second.load.total() > load + most_calls_ahead(user->second)) {
    return least_busy->second;
  }
  const auto ranked = ranking.find(rank_of(user->second));
  return ranked == ranking.end() ? least_busy->second : ranked->second;
}

/// Of the most closely named channels that have any in this ranking.
Instance* Instances::choose(ScopeGroup::Ranking ScopeGroup::*ranking, const std::string& uuid,
                            const fabric::ChannelKey& key) const {
  Instance* best = nullptr;
  if (const Group* const of = group(uuid)) {
    visit_scope_groups(*of, key, [&](const ScopeGroup& scope_group) {
      const ScopeGroup::Ranking& ranked = scope_group.*ranking;
      best = ranked.empty() ? nullptr : choose_in(*of, ranked, key);
      return best == nullptr;
    });
  }
  return best;
}

bool Instances::serves(const fabric::InstanceIdentity& identity, const fabric::ChannelKey& key) {
  return identity.channels.empty() ||
         std::ranges::any_of(identity.channels, [&](const fabric::ChannelScope& scope) {
           return (scope.machine.empty() || scope.machine == key.machine ||
                   scope.machine == fabric::machine_of(key.machine)) &&
                  (scope.channel == 0 || scope.channel == key.channel);
         });
}

std::size_t Instances::ready(const std::string& uuid, const fabric::ChannelKey& key) const {
  const Group* const of = group(uuid);
  if (of == nullptr) {
    return 0;
  }
  if (of->repeated > 0) {
    // One may serve the channel under two names.
    return static_cast<std::size_t>(std::ranges::count_if(of->members, [&](const auto& member) {
      return takes_calls(*member.second) && serves(member.second->identity, key);
    }));
  }
  std::size_t count = 0;
  visit_scope_groups(*of, key, [&](const ScopeGroup& scope_group) {
    count += scope_group.ready;
    return true;
  });
  return count;
}

Instances::Service Instances::service(const std::string& uuid,
                                      const fabric::ChannelKey& key) const {
  Service service;
  const Group* const of = group(uuid);
  if (of == nullptr) {
    return service;
  }
  visit_scope_groups(*of, key, [&](const ScopeGroup& scope_group) {
    service.served = service.served || scope_group.serving > 0;
    service.draining = service.draining || scope_group.draining > 0;
    return !service.served;
  });
  if (!service.served && !service.draining) {
    const auto seen =
        std::ranges::find_if(of->members, [](const auto& any) { return any.second->seen; });
    service.elsewhere = seen == of->members.end() ? nullptr : seen->second;
  }
  return service;
}

bool Instances::any_at_most_once(const std::string& uuid) const {
  const Group* const of = group(uuid);
  return of != nullptr && of->at_most_once > 0;
}

std::vector<std::string> Instances::uuids() const {
  std::vector<std::string> all;
  all.reserve(groups_.size());
  for (const auto& [uuid, group] : groups_) {
    all.push_back(uuid);
  }
  std::ranges::sort(all);
  return all;
}

std::optional<SteadyTime> Instances::next_alarm() const {
  return alarms_.empty() ? std::nullopt : std::optional(alarms_.begin()->first);
}

Instance* Instances::alarmed(SteadyTime now) {
  return alarms_.empty() || alarms_.begin()->first > now ? nullptr : find(alarms_.begin()->second);
}

}  // namespace millrace::gateway::dispatch
