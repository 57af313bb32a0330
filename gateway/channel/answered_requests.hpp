// Answered requests that still stand on the fabric. Pure.
//
//   answered.add({key, epoch, instance}, now);        // that instance has answered
//   answered.replace({key, epoch, instance});          // it is asked for the channel's next call
//   for (const auto& request : answered.due(now)) …    // withdraw them
//
// The next request of a channel to the same instance replaces the previous one on the fabric, so
// withdrawing each answered request first would tell no reader anything new and cost two messages a
// call. The remaining requests are withdrawn once they have been quiet for a while, so that a
// process that joins later finds only pending calls; not all at a time, so that calls do not wait.
#pragma once

#include <cstddef>
#include <list>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/request_key.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::channel {

class AnsweredRequests {
 public:
  /// A request stays for at least this long.
  static constexpr std::chrono::seconds quiet{1};
  /// How often quiet requests are searched, and the largest number that is withdrawn then.
  static constexpr std::chrono::milliseconds pause{250};
  static constexpr std::size_t at_once = 200;

  void add(const fabric::RequestKey& request, SteadyTime now);
  /// It stands for something else now, or not any more.
  void replace(const fabric::RequestKey& request);
  /// Forgets and returns what is left of the channel.
  std::vector<fabric::RequestKey> take(const fabric::ChannelKey& key);
  /// Forgets and returns all that is left.
  std::vector<fabric::RequestKey> take_all();
  /// Forgets and returns what has been quiet for long enough, the oldest first.
  std::vector<fabric::RequestKey> due(SteadyTime now);
  /// When due() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return sweep_; }

 private:
  using Left = std::list<std::pair<fabric::RequestKey, SteadyTime>>;

  Left oldest_first_;
  std::unordered_map<fabric::RequestKey, Left::iterator, fabric::RequestKeyHash> places_;
  std::optional<SteadyTime> sweep_;
};

}  // namespace millrace::gateway::channel
