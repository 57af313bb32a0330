// Follows calls through the events of their gateways.
//
//   if (auto call = follower.add(entry)) …      // it has ended
//   follower.under_way()                         // one of each channel at most
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

struct FollowedCall {
  fabric::CallId id{};
  fabric::ChannelKey key{};
  /// Canonical.
  std::string uuid{};
  /// None if the call was seen before the follower was there.
  std::optional<std::string> request{};
  std::uint32_t request_state = 0;
  std::string response{};
  std::uint32_t response_state = 0;
  std::uint32_t attempt = 0;
  fabric::InstanceId instance{};
  /// Name and host of the instance, if discovery has shown them.
  std::string instance_name{};
  std::string host{};
  fabric::Time seen{};
  /// Zero while it is under way.
  fabric::Time ended{};
  /// The last event: "dispatched", "held", … ; at the end `written` or `withdrawn`.
  fabric::EventKind last = fabric::EventKind::seen;
  /// Information for people beyond that.
  std::string detail{};
  bool replayed = false;

  /// From seen to ended; none unless both are known.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> duration() const;
};

/// Pure. Takes entries in the order in which they were received.
class CallFollower {
 public:
  /// The call that ends with this entry.
  std::optional<FollowedCall> add(const Entry& entry);

  [[nodiscard]] const std::map<fabric::ChannelKey, FollowedCall>& under_way() const {
    return under_way_;
  }

 private:
  struct Instance {
    std::string name;
    std::string host;
  };

  std::optional<FollowedCall> add(const fabric::Event& event);
  void name_instance(FollowedCall& call) const;

  std::map<fabric::ChannelKey, FollowedCall> under_way_;
  std::map<fabric::InstanceId, Instance> instances_;
};

}  // namespace millrace::tools::recording
