// Values of a limited number of recent calls. Pure.
//
//   CallMemory<CallKey, Reply, CallKeyHash> answered(1024);
//   answered.put(request.requester, name, reply);
//   if (const Reply* reply = answered.find(name)) …
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <unordered_map>
#include <utility>

namespace millrace::services::sdk {

template <typename Key, typename Value, typename Hash = std::hash<Key>>
class CallMemory {
 public:
  explicit CallMemory(std::size_t most) : most_(most) {}

  /// Replaces the call's earlier value. If there are too many, the oldest value of the requester
  /// with most values is removed: a busy requester so removes its own calls and not those of
  /// others.
  void put(std::uint64_t requester, const Key& call, Value value) {
    if (!known_.insert_or_assign(call, std::move(value)).second) {
      return;
    }
    order_[requester].push_back(call);
    if (known_.size() > most_) {
      const auto most =
          std::ranges::max_element(order_, {}, [](const auto& each) { return each.second.size(); });
      known_.erase(most->second.front());
      most->second.pop_front();
      if (most->second.empty()) {
        order_.erase(most);
      }
    }
  }

  /// Null if it is not stored.
  [[nodiscard]] const Value* find(const Key& call) const {
    const auto known = known_.find(call);
    return known == known_.end() ? nullptr : &known->second;
  }

 private:
  std::size_t most_;
  std::unordered_map<Key, Value, Hash> known_;
  /// By requester, the oldest first.
  std::map<std::uint64_t, std::deque<Key>> order_;
};

}  // namespace millrace::services::sdk
