// What is remembered of the last so many calls. Pure.
//
//   CallMemory<Reply> answered(1024);
//   answered.put(reply.call, reply);
//   if (const Reply* reply = answered.find(call)) …
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <utility>

#include "fabric/messages.hpp"

namespace millrace::services::sdk {

template <typename Value>
class CallMemory {
 public:
  explicit CallMemory(std::size_t most) : most_(most) {}

  /// In place of what was known of it. Forgets the call that was put first if it is one too many.
  void put(const fabric::CallId& call, Value value) {
    if (!known_.insert_or_assign(call, std::move(value)).second) {
      return;
    }
    order_.push_back(call);
    if (order_.size() > most_) {
      known_.erase(order_.front());
      order_.pop_front();
    }
  }

  /// Null if nothing is known of it.
  [[nodiscard]] const Value* find(const fabric::CallId& call) const {
    const auto known = known_.find(call);
    return known == known_.end() ? nullptr : &known->second;
  }

 private:
  std::size_t most_;
  std::map<fabric::CallId, Value> known_;
  std::deque<fabric::CallId> order_;
};

}  // namespace millrace::services::sdk
