// The commands that were carried out lately, and what came of them. Pure.
//
// A tool sends its command until it hears the outcome, and the fabric is full of commands for
// others meanwhile: a ping of a thousand instances is a thousand of them. So those of this gateway
// are remembered by time and not by how many others there were.
#pragma once

#include <chrono>
#include <cstddef>
#include <deque>
#include <map>
#include <utility>

#include "fabric/command.hpp"

namespace millrace::gateway::shell {

class CommandHistory {
 public:
  using Moment = std::chrono::steady_clock::time_point;
  /// Far longer than a tool waits for an outcome.
  static constexpr auto remembered = std::chrono::minutes(10);
  /// More than operators send in that time; a flood of them costs no more memory.
  static constexpr std::size_t most = 4096;

  /// What came of it; null if it is not known.
  [[nodiscard]] const fabric::Outcome* find(const fabric::InstanceId& command) const {
    const auto known = outcomes_.find(command);
    return known == outcomes_.end() ? nullptr : &known->second;
  }

  void add(const fabric::Outcome& outcome, Moment now) {
    while (!order_.empty() && (now - order_.front().first > remembered || order_.size() >= most)) {
      outcomes_.erase(order_.front().second);
      order_.pop_front();
    }
    if (outcomes_.emplace(outcome.command, outcome).second) {
      order_.emplace_back(now, outcome.command);
    }
  }

 private:
  std::map<fabric::InstanceId, fabric::Outcome> outcomes_;
  std::deque<std::pair<Moment, fabric::InstanceId>> order_;
};

}  // namespace millrace::gateway::shell
