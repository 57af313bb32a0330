// The recently executed commands, and their outcomes. Pure.
//
// A tool repeats its command until it receives the outcome, and the fabric may carry many commands
// for other receivers: a ping of a thousand instances is a thousand commands. So the commands of
// this gateway are kept by time and not by the number of others.
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
  /// More than operators send in that time; a flood of commands costs no more memory.
  static constexpr std::size_t most = 4096;

  /// The outcome; null if it is unknown.
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
