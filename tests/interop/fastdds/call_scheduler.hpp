// What a service does with what comes in: the section "A call" of docs/reference/wire.md. Pure:
// requests and results in, replies out; it owns no thread, clock or socket.
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

/// What a gateway asks of a channel: it has one call of it at a time. The DDS key of a request is
/// this and the instance.
struct RequestKey {
  std::string machine;
  std::uint16_t channel = 0;
  std::uint64_t epoch = 0;
  auto operator<=>(const RequestKey&) const = default;
};

RequestKey key_of(const Request& request);

class CallScheduler {
 public:
  /// `room`: calls that it takes at once.
  CallScheduler(const Id& own, std::size_t room) : own_(own), room_(room) {}

  /// A request that came in, and what is to be said to it at once.
  std::optional<Reply> take(const Request& request, Nanoseconds now);
  /// The request was taken back: nobody waits for its answer.
  void take_back(const RequestKey& key);
  /// A call that may run now; nothing if there is none, or no room.
  std::optional<Request> begin(Nanoseconds now);
  /// The answer to a call that ran; nothing if nobody waits for it any more.
  std::optional<Reply> finish(const Request& request, const std::string& text, std::uint32_t state,
                              Nanoseconds now);

  /// It takes nothing new.
  void leave() { leaving_ = true; }
  /// For the next heartbeat.
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
  /// The last answer to each: only that call can be asked for again.
  std::map<RequestKey, Reply> answered_;
  /// Number and attempt of the last one that was declined: it stays so.
  std::map<RequestKey, std::pair<std::uint64_t, std::uint32_t>> declined_;
  InstanceLoad counters_;
};

}  // namespace millrace::tests::interop::fastdds
