// The plant of one row: services, gateways and observers as processes, on this host or on hosts of
// their own, and what is measured on it.
#pragma once

#include <cstdint>
#include <string>

namespace millrace::bench {

struct PlantSize {
  std::uint32_t instances = 4;
  std::uint32_t processes = 4;
  /// 0: all instances are of one.
  std::uint32_t uuids = 0;
  std::uint32_t gateways = 1;
  /// Of each gateway.
  std::uint32_t machines = 1;
  /// Of each machine; each has a call under way.
  std::uint32_t channels = 64;
  /// Processes of `millrace record`.
  std::uint32_t observers = 0;
  /// The services', beside one of the gateways and observers; 0: everything is on this one.
  std::uint32_t hosts = 0;
};

/// Tells, as they are known: `known` (seconds from the start of the last service until each gateway
/// knew all instances), `calls_per_second` of all gateways together, `gateway` and `services` (us
/// of processor time for each call), `median` and `p99` (us, one call at a time for each gateway),
/// and of the time without calls `idle_gateways`, `idle_services`, `idle_observers` (% of a core).
void measure_plant(const PlantSize& size, std::uint32_t idle_seconds);

}  // namespace millrace::bench
