// The services, or the raw peers, of a measurement, spread over processes.
//
//   Fleet services({.kind = "inline", .domain = 1}, 64, 4);    // 16 in each of 4 processes
//   services.await_ready(limit);
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tests/bench/gateway/peers.hpp"
#include "tests/bench/series.hpp"

namespace millrace::bench {

class Fleet {
 public:
  /// Starts the processes without waiting for them. `each` describes an instance; raw peers get
  /// consecutive numbers from its number on.
  Fleet(const PeerOptions& each, std::uint32_t instances, std::uint32_t processes);

  /// True once every process has reported that it is ready; false when `limit` is over or one has
  /// ended.
  bool await_ready(std::chrono::milliseconds limit);

  /// When the last of them was started.
  [[nodiscard]] Clock::time_point started() const { return started_; }
  /// Processor time of all that still run, since their start.
  [[nodiscard]] double processor_seconds() const;
  /// The standard error of the first process that has written there; empty if none has.
  [[nodiscard]] std::string problem() const;
  /// The exit codes of processes that have ended, as in a shell; none was asked to.
  [[nodiscard]] std::vector<int> ended();

 private:
  std::vector<tests::Process> processes_;
  Clock::time_point started_;
};

}  // namespace millrace::bench
