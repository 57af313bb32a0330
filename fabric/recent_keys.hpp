// The keys of which something was said lately. Pure.
//
//   if (auto old = keys.use(key_of(reply))) …     // nothing was said of `old` for longest: removed
//
// Each gateway, and each tool that calls in a gateway's place, has keys of its own. A service that
// runs for years would keep the last answer to every one of them.
#pragma once

#include <cstddef>
#include <list>
#include <optional>
#include <unordered_map>
#include <utility>

#include "fabric/request_key.hpp"

namespace millrace::fabric {

class RecentKeys {
 public:
  /// `most` ≥ 1 keys are remembered.
  explicit RecentKeys(std::size_t most) : most_(most) {}

  /// `key` was used now. Removes and returns the oldest key if there is one too many.
  std::optional<RequestKey> use(const RequestKey& key) {
    if (const auto known = places_.find(key); known != places_.end()) {
      oldest_first_.splice(oldest_first_.end(), oldest_first_, known->second);
      return std::nullopt;
    }
    places_.emplace(key, oldest_first_.insert(oldest_first_.end(), key));
    if (places_.size() <= most_) {
      return std::nullopt;
    }
    std::optional<RequestKey> old(std::move(oldest_first_.front()));
    oldest_first_.pop_front();
    places_.erase(*old);
    return old;
  }

  [[nodiscard]] bool knows(const RequestKey& key) const { return places_.contains(key); }

 private:
  std::size_t most_;
  std::list<RequestKey> oldest_first_;
  std::unordered_map<RequestKey, std::list<RequestKey>::iterator, RequestKeyHash> places_;
};

}  // namespace millrace::fabric
