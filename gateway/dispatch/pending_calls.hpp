// The calls of a dispatcher, indexed by id, by instance, and by what they wait for. Pure.
//
//   PendingCall& call = calls.enter({.call = id, .key = key, .uuid = "560aacbf-…"});
//   calls.assign(call, instance);            // it has the call now
//   calls.queue(call);                          // without an instance, it waits for one
//   calls.hold(call);                           // … for an operator
//   if (const PendingCalls::Queue* queue = calls.waiting("560aacbf-…")) …
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>

#include "fabric/messages.hpp"
#include "gateway/call_record.hpp"
#include "gateway/dispatch/instances.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::dispatch {

/// A call of the dispatcher, waiting or dispatched.
struct PendingCall {
  std::shared_ptr<const CallRecord> record{};
  /// Canonical.
  std::string uuid{};
  /// The last one; its attempt is 0 before the first.
  Assignment assignment{};
  /// Counted from 1, in the order of their arrival.
  std::uint64_t number = 0;
  /// The instance that has the call, or null.
  Instance* at = nullptr;
  /// Whether it is among those that wait for an instance, or among the blocked calls.
  enum class Place : std::uint8_t { none, queued, held };
  Place place = Place::none;
  fabric::Message reason{};
  /// When its request was last sent, and the number of heartbeats since then that should have named
  /// it and did not.
  struct Published {
    std::optional<SteadyTime> at;
    unsigned unknown = 0;
  };
  Published published{};

  [[nodiscard]] const fabric::CallId& id() const { return record->id; }
  [[nodiscard]] const fabric::ChannelKey& key() const { return record->key; }
};

class PendingCalls {
 public:
  /// By the order of their arrival.
  using Queue = std::map<std::uint64_t, PendingCall*>;

  PendingCalls() = default;
  PendingCalls(const PendingCalls&) = delete;
  PendingCalls& operator=(const PendingCalls&) = delete;

  /// A call without an instance; its address stays the same until it is removed.
  PendingCall& enter(PendingCall pending);
  /// Null if there is none.
  [[nodiscard]] PendingCall* find(const fabric::CallId& call);
  void forget(PendingCall& pending);

  /// Each of these removes the call from its instance and from its queue first.
  void assign(PendingCall& pending, Instance& instance);
  void queue(PendingCall& pending);
  void hold(PendingCall& pending);

  /// Those of a canonical UUID that wait for an instance; null if there is none.
  [[nodiscard]] const Queue* waiting(const std::string& uuid) const;
  /// The calls that wait for an operator.
  [[nodiscard]] const Queue& held() const { return held_; }

  /// Must be called within Instances::change_load after a change of `waits` of a call of this
  /// instance.
  static void note_waiters(Instance& instance);

 private:
  struct IdHash {
    std::size_t operator()(const fabric::CallId& id) const { return id.epoch ^ id.number; }
  };

  void detach(PendingCall& pending);

  /// A hash map, since each of a thousand channels searches it several times in a call.
  std::unordered_map<fabric::CallId, PendingCall, IdHash> calls_;
  std::unordered_map<std::string, Queue> waiting_;
  Queue held_;
  std::uint64_t entered_ = 0;
};

}  // namespace millrace::gateway::dispatch
