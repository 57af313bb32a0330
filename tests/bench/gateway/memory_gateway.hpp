// The gateway's core on a real fabric, with controllers in memory: the cost of a call without ADS.
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
#include "tests/bench/series.hpp"

namespace millrace::bench {

/// The machines of a gateway, and its network.
struct MemoryPlant {
  std::uint32_t domain = 0;
  /// Each machine has the channels 1 to this; `active` of them call as fast as they can.
  std::size_t channels = 1;
  std::size_t active = 1;
  /// Time between two reads of an idle or waiting channel.
  std::chrono::milliseconds idle{10};
  std::vector<std::string> machines{"cnc"};
  /// The channels call this many UUIDs in turn, those of the peers "uuids"; 0: the UUID of the
  /// others.
  std::uint32_t uuids = 0;
  /// The network interface; empty: the loopback.
  std::string interface {};
};

class MemoryGateway {
 public:
  explicit MemoryGateway(const MemoryPlant& plant);
  /// Channels 1 to `channels`, of which `active` run programs that call as fast as they can. `idle`
  /// is the time between two reads of an idle or waiting channel.
  MemoryGateway(std::uint32_t domain, std::size_t channels, std::size_t active,
                std::chrono::milliseconds idle = std::chrono::milliseconds(10));
  ~MemoryGateway();

  /// Runs until this many instances are ready.
  void await_instances(std::size_t count);

  struct Result {
    /// From a call's acceptance to the arrival of its reply.
    Series replied;
    /// From a program's REQUEST_STATE to its RESPONSE_STATE.
    Series released;
    double calls_per_second = 0;
    /// Processor time of this process per call.
    double microseconds_per_call = 0;
  };
  /// From now on only the first channel of the first machine calls.
  void call_on_one_channel();
  /// From now on the gateway's thread sleeps while it waits for an answer, without spinning.
  void doze();
  /// Runs this many calls.
  Result run(std::size_t calls);
  /// The same; nothing if they are not answered within `limit`.
  std::optional<Result> run_within(std::size_t calls, std::chrono::milliseconds limit);

  /// Runs until `done` is true.
  void run_until(const std::function<bool()>& done);
  /// The same; false if `limit` is over before.
  bool run_until(const std::function<bool()>& done, std::chrono::milliseconds limit);
  /// The number of ready instances.
  [[nodiscard]] std::size_t instances() const;
  /// The number of instances lost since the start.
  [[nodiscard]] std::size_t lost() const;
  /// The time and the instance of the last dispatch.
  [[nodiscard]] Clock::time_point given_at() const;
  [[nodiscard]] fabric::InstanceId given_to() const;
  [[nodiscard]] std::uint32_t given_attempt() const;
  /// The process of an instance.
  [[nodiscard]] std::uint32_t pid_of(const fabric::InstanceId& instance) const;
  /// The programs withdraw their requests and stop calling.
  void withdraw();
  /// The programs begin to call, `calls` times altogether.
  void begin(std::size_t calls);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::bench
