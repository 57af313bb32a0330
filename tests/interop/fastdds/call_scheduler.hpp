// A service's reaction to requests: the section "A call" of docs/reference/wire.md. Pure: requests
// and results in, replies out; it owns no thread, clock or socket.
//
//   CallScheduler scheduler(id, 4);
//   auto reply = scheduler.take(request, now);      // a repeat, or that there is no room
//   while (auto call = scheduler.begin(now)) …      // what is to run now
//   reply = scheduler.finish(key_of(*call), "2", 1, now);
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "identity.hpp"
#include "millrace.h"

namespace millrace::tests::interop::fastdds {

/// Nanoseconds since 1970 UTC.
using Nanoseconds = std::int64_t;

/// The channel of a request, which has one call at a time. The DDS key of a request is this and the
/// instance.
struct RequestKey {
  std::string machine;
  std::uint16_t channel = 0;
  std::uint64_t epoch = 0;
  auto operator<=>(const RequestKey&) const = default;
};

RequestKey key_of(const Request& request);

class CallScheduler {
 public:
  /// `room`: the number of calls at once.
  CallScheduler(const Id& own, std::size_t room) : own_(own), room_(room) {}

  /// Takes a request; returns an immediate reply, if there is one.
  std::optional<Reply> take(const Request& request, Nanoseconds now);
  /// The request was withdrawn: its call is cancelled.
  void take_back(const RequestKey& key);
  /// The next call to run; nothing without one, or without room.
  std::optional<Request> begin(Nanoseconds now);
  /// The answer to a call that ran; nothing if it was cancelled.
  std::optional<Reply> finish(const Request& request, const std::string& text, std::uint32_t state,
                              Nanoseconds now);

  /// Takes no new calls.
  void leave() { leaving_ = true; }
  /// The load for the next heartbeat.
  [[nodiscard]] InstanceLoad load() const;
  [[nodiscard]] bool idle() const { return running_.empty() && waiting_.empty(); }

 private:
  struct Call {
    Request request;
    Nanoseconds received = 0;
    Nanoseconds started = 0;
    /// Its program has given it up.
    bool over = false;
  };

  [[nodiscard]] Reply reply_to(const Request& request) const;
  [[nodiscard]] bool must_decline(const Request& request) const;
  void supersede(const Request& by);
  Call* find(const Request& request);
  void give_up(const RequestKey& key, std::uint64_t but_number);

  const Id own_;
  const std::size_t room_;
  bool leaving_ = false;
  std::deque<Call> waiting_;
  std::deque<Call> running_;
  /// The last answer of each key: only that call can be requested again.
  std::map<RequestKey, Reply> answered_;
  /// Number and attempt of the last declined call, which stays declined.
  std::map<RequestKey, std::pair<std::uint64_t, std::uint32_t>> declined_;
  InstanceLoad counters_;
};

}  // namespace millrace::tests::interop::fastdds
