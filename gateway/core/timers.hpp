// When each channel must be read again.
//
//   timers.set(key, at);
//   for (const auto& key : timers.take_due(now.steady)) …       // once timers.next() has come
//
// A channel may be due too early: a later time than the one it is set to changes nothing, and its
// owner sets it again when it is due. A call moves its channel's next read several times, and to
// sort the channel again each time costs more than an early time now and then.
#pragma once

#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/request_key.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::core {

class Timers {
 public:
  /// The channel is due at this time or before.
  void set(const fabric::ChannelKey& key, SteadyTime at);
  void remove(const fabric::ChannelKey& key);
  /// When the next channel is due.
  [[nodiscard]] std::optional<SteadyTime> next() const;
  /// Those that are due, in the order of their times; they are not set any more.
  [[nodiscard]] std::vector<fabric::ChannelKey> take_due(SteadyTime now);

 private:
  /// In the map, whose keys stay where they are.
  using Due = std::pair<SteadyTime, const fabric::ChannelKey*>;
  struct Before {
    bool operator()(const Due& a, const Due& b) const;
  };

  std::unordered_map<fabric::ChannelKey, SteadyTime, fabric::ChannelKeyHash> times_;
  std::set<Due, Before> order_;
};

}  // namespace millrace::gateway::core
