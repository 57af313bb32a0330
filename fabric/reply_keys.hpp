// The replies that a requester takes, by their keys: Cyclone keeps about 0.6 kB of each key until
// its writer is gone, and a stranger can invent any number. Pure.
//
//   keys.ask(key_of(request));            // before it is published
//   if (!keys.admits(key_of(reply))) …    // dropped before anything is kept of it
#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_set>

#include "fabric/request_key.hpp"

namespace millrace::fabric {

class ReplyKeys {
 public:
  /// Of pending requests: channels times instances, far more than a requester has.
  static constexpr std::size_t most_asked = 65'536;
  /// Of other requests: what instances replied before this requester asks again, or replied to
  /// others.
  static constexpr std::size_t most_others = 16'384;

  void ask(const RequestKey& key) { asked_.put(key); }

  bool admits(const RequestKey& key) {
    if (asked_.contains(key) || others_.contains(key)) {
      return true;
    }
    if (others_.size() < most_others) {
      others_.insert(key);
      return true;
    }
    ++dropped_;
    return false;
  }

  /// Number of replies that were not admitted.
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  RecentRequests<> asked_{most_asked};
  std::unordered_set<RequestKey, RequestKeyHash> others_;
  std::uint64_t dropped_ = 0;
};

}  // namespace millrace::fabric
