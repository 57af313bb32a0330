// The rows of `millrace services`: one for each service, problems first, then the busiest. Pure.
#pragma once

#include <string>
#include <vector>

#include "tools/bus/fabric_model.hpp"

namespace millrace::tools::commands::look {

struct ServiceRow {
  std::string uuid{};
  /// Of its instances: "square_root", "lathe, mill".
  std::string name{};
  /// Those that run.
  std::vector<const bus::KnownInstance*> instances{};
  /// Sums over these.
  std::uint64_t running = 0;
  std::uint64_t capacity = 0;
  std::uint64_t answered = 0;
  std::uint64_t failed = 0;
  /// Per answered call; none before the first.
  std::optional<std::chrono::nanoseconds> mean{};
  /// Channels whose call waits for an instance.
  std::uint64_t waiting = 0;
  /// "no running instance", "1 instance without heartbeat (vm, pid 17)", what an instance reports.
  std::string problem{};
};

/// Also services without an instance that a channel waits for, or that have lost their last one.
std::vector<ServiceRow> service_rows(const bus::FabricModel& live, fabric::Time now);

}  // namespace millrace::tools::commands::look
