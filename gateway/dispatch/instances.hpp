// The instances that a dispatcher knows, found by UUID, by channel and by load without looking
// through them. Pure.
//
//   Instance& one = instances.enter(identity.id);
//   instances.change(one, [&] { one.identity = identity; });
//   instances.load(one, one.running + 1, ++given);
//   Instance* best = instances.choose("560aacbf-…", {"cnc", 1});
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::dispatch {

struct Job;
struct Bucket;

/// What is chosen by is changed through Instances only.
struct Instance {
  fabric::InstanceIdentity identity;
  /// Calls of ours that it has, and those that are held because it was lost with them.
  std::vector<Job*> jobs;
  /// Those of them that it has.
  std::uint32_t running = 0;
  /// When it was last given a call, counted in calls; for the round robin.
  std::uint64_t last_used = 0;
  /// Gone; lost at this time unless it comes back.
  std::optional<SteadyTime> lost_at;
  /// False for an instance that only the journal has named yet.
  bool seen = true;
  /// Where Instances has it.
  std::vector<Bucket*> buckets;

  [[nodiscard]] std::uint32_t room() const {
    const std::uint32_t most = identity.concurrency == 0 ? 1 : identity.concurrency;
    return running < most ? most - running : 0;
  }
};

/// The instances of a UUID that name the same channels.
struct Bucket {
  /// Least load first, then the one that has waited longest; the id makes the order certain.
  using Rank = std::tuple<std::uint32_t, std::uint64_t, fabric::InstanceId>;
  std::map<Rank, Instance*> with_room;
  /// They take calls.
  std::size_t ready = 0;
  /// They serve, gone for a moment or not; they drain.
  std::size_t serving = 0;
  std::size_t draining = 0;
  std::size_t all = 0;
};

class Instances {
 public:
  Instances() = default;
  Instances(const Instances&) = delete;
  Instances& operator=(const Instances&) = delete;

  [[nodiscard]] Instance* find(const fabric::InstanceId& id);
  /// The one of this id, made if there is none; its address stays until it is erased.
  Instance& enter(const fabric::InstanceId& id);
  void erase(Instance& instance);
  /// How many calls it has, and when it was last given one.
  void load(Instance& instance, std::uint32_t running, std::uint64_t last_used);
  /// Has `make` change anything else of it.
  template <typename Make>
  void change(Instance& instance, Make make) {
    unlist(instance);
    make();
    list(instance);
  }

  /// Who gets a call: of those with room the one that names the channel most closely, then the
  /// least busy, then the one that was longest without. Null if none has room.
  [[nodiscard]] Instance* choose(const std::string& uuid, const fabric::ChannelKey& key);
  /// Whether it serves the channel.
  [[nodiscard]] static bool serves(const fabric::InstanceIdentity& identity,
                                   const fabric::ChannelKey& key);

  /// How many of those that serve the channel take calls, busy or not.
  [[nodiscard]] std::size_t ready(const std::string& uuid, const fabric::ChannelKey& key) const;
  /// What the instances of a UUID are to a channel, whether they are gone for a moment or not.
  struct Service {
    bool served = false;
    /// It is served by instances that drain only.
    bool draining = false;
    /// Somebody who serves other channels only, or null.
    const Instance* elsewhere = nullptr;
  };
  [[nodiscard]] Service service(const std::string& uuid, const fabric::ChannelKey& key) const;
  [[nodiscard]] bool any_at_most_once(const std::string& uuid) const;
  /// In their order.
  [[nodiscard]] std::vector<std::string> uuids() const;

  /// The earliest lost_at.
  [[nodiscard]] std::optional<SteadyTime> next_loss() const;
  /// Somebody whose time has come, or null.
  [[nodiscard]] Instance* lost(SteadyTime now);

 private:
  struct Group {
    std::map<fabric::ChannelScope, Bucket> buckets;
    std::map<fabric::InstanceId, const Instance*> members;
    std::size_t at_most_once = 0;
    /// Instances that are in more than one bucket.
    std::size_t repeated = 0;
  };

  void list(Instance& instance);
  void unlist(Instance& instance);
  static void rank(Instance& instance);
  static void unrank(const Instance& instance);
  [[nodiscard]] const Group* group(const std::string& uuid) const;
  template <typename Visit>
  static void visit_buckets(const Group& group, const fabric::ChannelKey& key, Visit visit);

  std::map<fabric::InstanceId, Instance> instances_;
  std::unordered_map<std::string, Group> groups_;
  std::set<std::pair<SteadyTime, fabric::InstanceId>> losses_;
};

}  // namespace millrace::gateway::dispatch
