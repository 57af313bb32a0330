// The plant of one row: services, gateways and observers as processes, on this host or on separate
// hosts, and its measurements.
#pragma once

#include <cstdint>
#include <string>

namespace millrace::bench {

struct PlantSize {
  std::uint32_t instances = 4;
  std::uint32_t processes = 4;
  /// 0: all instances have the same one.
  std::uint32_t uuids = 0;
  std::uint32_t gateways = 1;
  /// Of each gateway.
  std::uint32_t machines = 1;
  /// Of each machine; each has a call under way.
  std::uint32_t channels = 64;
  /// Processes of `millrace record`.
  std::uint32_t observers = 0;
  /// Hosts of the services, in addition to the one of the gateways and observers; 0: everything is
  /// on that one.
  std::uint32_t hosts = 0;
};

/// Sends these figures as they are known: `known` (seconds from the start of the last service until
/// each gateway knew all instances), `calls_per_second` of all gateways together, `gateway` and
/// `services` (us of processor time per call), `median` and `p99` (us, one call at a time for each
/// gateway), and for the time without calls `idle_gateways`, `idle_services`, `idle_observers` (%
/// of a core).
void measure_plant(const PlantSize& size, std::uint32_t idle_seconds);

}  // namespace millrace::bench
