// Answered requests that still stand on the fabric. Pure.
//
// clang-format off
//   answered.keep(key, uuid, now);                             // its instance has answered, nobody runs it
//   if (auto old = answered.replace(key, uuid)) …              // the channel's next request: withdraw `old`
//   for (auto& [key, uuid] : answered.due(now)) …              // withdraw them
// clang-format on
//
// The next request of a channel replaces the one before on the fabric, so taking each answered one
// back first would say nothing new to anybody: it would cost each instance of the UUID two messages
// a call, and Cyclone, which frees at most about a thousand DDS instances a second, memory without
// limit above that rate. What is left is taken back once its channel has been quiet for a while, so
// that a process that joins later finds pending calls only.
#pragma once

#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "fabric/channel_key_hash.hpp"
#include "fabric/messages.hpp"
#include "gateway/moment.hpp"

namespace millrace::gateway::control {

class AnsweredRequests {
 public:
  /// A request stays for at least this long, and for less than twice as long.
  static constexpr std::chrono::seconds quiet{1};

  void keep(const fabric::ChannelKey& key, const std::string& uuid, SteadyTime now);

  /// The channel publishes a request of `uuid`, or withdraws it. The UUID of what is left of
  /// another one: it is to be withdrawn.
  std::optional<std::string> replace(const fabric::ChannelKey& key, const std::string& uuid);

  /// Forgets what is left of the channel and returns its UUID.
  std::optional<std::string> take(const fabric::ChannelKey& key);

  /// Forgets and returns all that is left.
  std::vector<std::pair<fabric::ChannelKey, std::string>> take_all();

  /// Forgets and returns what has been quiet for long enough.
  std::vector<std::pair<fabric::ChannelKey, std::string>> due(SteadyTime now);
  /// When due() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return sweep_; }

 private:
  struct Left {
    std::string uuid;
    SteadyTime since;
  };
  std::unordered_map<fabric::ChannelKey, Left, fabric::ChannelKeyHash> left_;
  std::optional<SteadyTime> sweep_;
};

}  // namespace millrace::gateway::control
