// The instances of a dispatcher, indexed by UUID, channel and load. Pure.
//
//   Instance& instance = instances.enter(identity.id);
//   instances.change(instance, [&] { instance.identity = identity; });
//   instances.change_load(instance, [](Load& load) { ++load.running; });
//   Instance* best = instances.choose(&ScopeGroup::with_room, "560aacbf-…", {"cnc", 1});
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/messages.hpp"
#include "fabric/request_key.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::dispatch {

struct PendingCall;
struct ScopeGroup;

/// The load of an instance, by which it is ranked.
struct Load {
  /// Our calls that it has.
  std::uint32_t running = 0;
  /// Its other calls, of other gateways or earlier runs, by its last heartbeat.
  std::uint32_t others = 0;
  /// One of ours waits there for its turn.
  bool has_waiter = false;
  /// When it was last used, counted in calls of its UUID.
  std::uint64_t last_used = 0;

  [[nodiscard]] std::uint32_t total() const { return running + others; }
};

/// The fields that dispatch depends on are changed only through Instances.
struct Instance {
  fabric::InstanceIdentity identity;
  /// For people; see Assignment.
  std::shared_ptr<const std::string> name{};
  /// Our calls that it has, and the blocked ones that were lost with it.
  std::vector<PendingCall*> calls;
  Load load;
  /// Gone; lost at this time unless it comes back.
  std::optional<SteadyTime> lost_at;
  /// It has declined a call: until it announces room, or until this time.
  std::optional<SteadyTime> busy_until;
  /// It is there and does not read its requests; until this time nothing more is tried.
  std::optional<SteadyTime> unresponsive_until;
  /// Declined since it last answered.
  unsigned declined = 0;
  /// False for an instance that only the journal has named yet.
  bool seen = true;
  /// Its places in Instances.
  std::vector<ScopeGroup*> scope_groups;

  [[nodiscard]] std::uint32_t most() const {
    return identity.concurrency == 0 ? 1 : identity.concurrency;
  }
  /// It would have room for another of our calls, without those of others.
  [[nodiscard]] bool has_place() const { return load.running < most(); }
  [[nodiscard]] bool has_room() const { return load.total() < most() && !busy_until; }
  /// The first of its times.
  [[nodiscard]] std::optional<SteadyTime> alarm() const {
    return earliest({lost_at, busy_until, unresponsive_until});
  }
};

/// The instances of a UUID that name the same channels.
struct ScopeGroup {
  /// Least load first, then the one that was used last; the id makes the order certain.
  using Rank = std::tuple<std::uint32_t, std::uint64_t, fabric::InstanceId>;
  using Ranking = std::map<Rank, Instance*>;
  Ranking with_room;
  /// Without room because of other gateways, and without a waiting call of ours: the queues that a
  /// call joins if none has room.
  Ranking shared;
  /// They take calls.
  std::size_t ready = 0;
  /// They serve, gone for a moment or not; they drain.
  std::size_t serving = 0;
  std::size_t draining = 0;
  std::size_t all = 0;
};

class Instances {
 public:
  static constexpr std::uint64_t calls_in_a_row = 64;

  Instances() = default;
  Instances(const Instances&) = delete;
  Instances& operator=(const Instances&) = delete;

  [[nodiscard]] Instance* find(const fabric::InstanceId& id);
  [[nodiscard]] std::size_t size() const { return instances_.size(); }
  /// The one of this id, made if there is none; its address stays until it is erased.
  Instance& enter(const fabric::InstanceId& id);
  void erase(Instance& instance);
  /// `make` changes only its load.
  template <typename Make>
  static void change_load(Instance& instance, Make make) {
    unrank(instance);
    make(instance.load);
    rank(instance);
  }
  /// Has `make` change anything of it.
  template <typename Make>
  void change(Instance& instance, Make make) {
    unlist(instance);
    make();
    list(instance);
  }

  /// The instance for a call, or null: of those in the ranking the one that names the channel most
  /// closely, then the least busy, then the one that was used last: its process may still be awake.
  /// A channel stays with the instance of its last call, which has the channel's entries in the
  /// caches, while that one is hardly busier than the least busy one. Each call number that
  /// `calls_in_a_row` divides goes to the longest unused instead.
  [[nodiscard]] Instance* choose(ScopeGroup::Ranking ScopeGroup::*ranking, const std::string& uuid,
                                 const fabric::ChannelKey& key) const;
  /// It gets a call of the channel; its load changes with it.
  void use(Instance& instance, const fabric::ChannelKey& key) {
    Group& group = groups_.at(instance.identity.uuid);
    instance.load.last_used = ++group.calls;
    group.last_instances.insert_or_assign(key, instance.identity.id);
  }
  /// Whether it serves the channel.
  [[nodiscard]] static bool serves(const fabric::InstanceIdentity& identity,
                                   const fabric::ChannelKey& key);

  /// The number of instances that serve the channel and accept calls, busy or not.
  [[nodiscard]] std::size_t ready(const std::string& uuid, const fabric::ChannelKey& key) const;
  /// The instances of a UUID as seen from a channel, including temporarily lost ones.
  struct Service {
    bool served = false;
    /// It is served by instances that drain only.
    bool draining = false;
    /// An instance that serves only other channels, or null.
    const Instance* elsewhere = nullptr;
  };
  [[nodiscard]] Service service(const std::string& uuid, const fabric::ChannelKey& key) const;
  [[nodiscard]] bool any_at_most_once(const std::string& uuid) const;
  /// In their order.
  [[nodiscard]] std::vector<std::string> uuids() const;

  /// The earliest alarm.
  [[nodiscard]] std::optional<SteadyTime> next_alarm() const;
  /// An instance whose timer has expired, or null.
  [[nodiscard]] Instance* alarmed(SteadyTime now);

 private:
  struct Group {
    std::map<fabric::ChannelScope, ScopeGroup> scope_groups;
    std::map<fabric::InstanceId, const Instance*> members;
    std::size_t at_most_once = 0;
    /// Instances that are in more than one bucket.
    std::size_t repeated = 0;
    /// The number of calls that were assigned.
    std::uint64_t calls = 0;
    /// The instance of each channel's last call; it may be gone, or serve another UUID by now.
    std::unordered_map<fabric::ChannelKey, fabric::InstanceId, fabric::ChannelKeyHash>
        last_instances;
  };

  void list(Instance& instance);
  void unlist(Instance& instance);
  static void rank(Instance& instance);
  static void unrank(const Instance& instance);
  [[nodiscard]] Instance* choose_in(const Group& group, const ScopeGroup::Ranking& ranking,
                                    const fabric::ChannelKey& key) const;
  [[nodiscard]] const Group* group(const std::string& uuid) const;
  template <typename Visit>
  static void visit_scope_groups(const Group& group, const fabric::ChannelKey& key, Visit visit);

  std::map<fabric::InstanceId, Instance> instances_;
  std::unordered_map<std::string, Group> groups_;
  std::set<std::pair<SteadyTime, fabric::InstanceId>> alarms_;
};

}  // namespace millrace::gateway::dispatch
