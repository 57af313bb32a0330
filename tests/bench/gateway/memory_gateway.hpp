// The gateway's core on a real fabric, with controllers in memory: what a call costs without ADS.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fabric/messages.hpp"
#include "tests/bench/gateway/series.hpp"

namespace millrace::bench {

/// What a gateway serves, and where.
struct MemoryPlant {
  std::uint32_t domain = 0;
  /// Of each machine, 1 to this; so many of them call as fast as they can.
  std::size_t channels = 1;
  std::size_t active = 1;
  /// Between two looks at a channel that is idle or waits.
  std::chrono::milliseconds idle{10};
  std::vector<std::string> machines{"cnc"};
  /// The channels call so many UUIDs in turn, those of the peers "uuids"; 0: the one of the others.
  std::uint32_t uuids = 0;
  /// The network interface; empty: the loopback.
  std::string interface {};
};

class MemoryGateway {
 public:
  explicit MemoryGateway(const MemoryPlant& plant);
  /// Channels 1 to `channels`, whose programs call as fast as they can, `active` of them. `idle` is
  /// the time between two looks at a channel that is idle or waits.
  MemoryGateway(std::uint32_t domain, std::size_t channels, std::size_t active,
                std::chrono::milliseconds idle = std::chrono::milliseconds(10));
  ~MemoryGateway();

  /// Runs until so many instances are ready.
  void await_instances(std::size_t count);

  struct Result {
    /// From a call's acceptance until its reply is here.
    Series replied;
    /// From a program's REQUEST_STATE to its RESPONSE_STATE.
    Series released;
    double calls_per_second = 0;
    /// Processor time of this process for each call.
    double microseconds_per_call = 0;
  };
  /// From now on the first channel of the first machine calls, and no other.
  void call_on_one_channel();
  /// From now on the gateway's thread sleeps at once while it waits for an answer.
  void doze();
  /// Runs so many calls.
  Result run(std::size_t calls);
  /// The same; nothing if they are not answered within `limit`.
  std::optional<Result> run_within(std::size_t calls, std::chrono::milliseconds limit);

  /// Runs until `done` says so.
  void run_until(const std::function<bool()>& done);
  /// The same; false if `limit` is over before.
  bool run_until(const std::function<bool()>& done, std::chrono::milliseconds limit);
  /// Instances that are ready.
  [[nodiscard]] std::size_t instances() const;
  /// Instances that were lost since the start.
  [[nodiscard]] std::size_t lost() const;
  /// The last time a call was given out, and to whom.
  [[nodiscard]] Clock::time_point given_at() const;
  [[nodiscard]] fabric::InstanceId given_to() const;
  [[nodiscard]] std::uint32_t given_attempt() const;
  /// The process of an instance.
  [[nodiscard]] std::uint32_t pid_of(const fabric::InstanceId& instance) const;
  /// The programs take their requests back and call no more.
  void withdraw();
  /// The programs begin to call; as often as `calls` in all.
  void begin(std::size_t calls);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::bench
