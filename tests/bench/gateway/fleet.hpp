// The services, or the raw peers, of a measurement: so many instances, spread over processes.
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
#include "tests/bench/gateway/series.hpp"

namespace millrace::bench {

class Fleet {
 public:
  /// Starts the processes as fast as it can and waits for none of them. `each` says what an
  /// instance is; raw peers are numbered on from its number.
  Fleet(const PeerOptions& each, std::uint32_t instances, std::uint32_t processes);

  /// True once every process says that it is ready; false when `limit` is over or one has ended.
  bool await_ready(std::chrono::milliseconds limit);

  /// When the last of them had been started.
  [[nodiscard]] Clock::time_point started() const { return started_; }
  /// Processor time of all that still run, since their start.
  [[nodiscard]] double processor_seconds() const;
  /// What a process has written to its standard error: the first that has, nothing if none has.
  [[nodiscard]] std::string problem() const;
  /// How those that have ended did so, as a shell says it; nobody was asked to.
  [[nodiscard]] std::vector<int> ended();

 private:
  std::vector<tests::Process> processes_;
  Clock::time_point started_;
};

}  // namespace millrace::bench
