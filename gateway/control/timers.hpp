// When each channel is to be looked at again.
//
//   timers.set(key, at);
//   for (const auto& key : timers.take_due(now.steady)) …       // once timers.next() has come
//
// A channel may be due too early: one that is set to a later time than before is left where it
// stands, and sets itself anew then. A call moves its channel's next read several times, and to
// move it in the order costs more than to be due once in a while for nothing.
#pragma once

#include <optional>
#include <set>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/channel_key_hash.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::control {

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

}  // namespace millrace::gateway::control
