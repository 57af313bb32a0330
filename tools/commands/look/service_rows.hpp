// The rows and columns of `millrace services`: of services, and of their instances. Pure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "fabric/plant/plant.hpp"
#include "tools/bus/operator.hpp"
#include "tools/print/listing.hpp"

namespace millrace::tools::commands::look {

struct ServiceRow {
  std::string uuid{};
  /// Of its instances: "square_root", "lathe, mill".
  std::string name{};
  /// Those that run.
  std::vector<const fabric::plant::KnownInstance*> instances{};
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
/// Problems first, then the busiest.
std::vector<ServiceRow> service_rows(const fabric::plant::Plant& live, fabric::Time now);
const print::Listing<ServiceRow>& services_listing();

struct InstanceRow {
  const fabric::plant::KnownInstance* instance = nullptr;
  bool is_gone = false;
  std::vector<const fabric::Alarm*> alarms{};
  bool was_asked = false;
  std::optional<bus::CommandResult> answer{};
};

/// Also those without heartbeat if `with_gone`. Problems first, then by name.
std::vector<InstanceRow> instance_rows(const fabric::plant::Plant& live, bool with_gone);
const print::Listing<InstanceRow>& instances_listing();

/// For a column: the name, or the beginning of the UUID where none is known, "560aacbf…".
std::string service_text(const std::string& name, const std::string& uuid);

/// "cnc/1 mill/*", or "all".
std::string channels_text(const fabric::InstanceIdentity& identity);

}  // namespace millrace::tools::commands::look
