// The cost of idle instances: processes of one UUID and a gateway on one host, compared with as
// many raw Cyclone peers.
#pragma once

#include <cstdint>
#include <vector>

namespace millrace::bench {

struct PresenceOptions {
  /// Service processes of each row.
  std::vector<std::uint32_t> instances{10, 30, 50, 100, 200};
  /// How long their processor time is measured. A participant announces itself every 8 s if its
  /// lease is 10 s, every 24 s if it is 30 s. The time covers whole rounds, because they are most
  /// of the work.
  std::uint32_t idle_seconds = 24;
  /// If not 0, the measurement is a different one: one process with this many UUIDs.
  std::uint32_t uuids = 0;
  /// Two hundred raw processes use both cores for minutes.
  bool without_raw = false;
};

/// All rows, each in its own process. True if the goals are met.
bool measure_presence(const PresenceOptions& options);
/// One row: of the first number of instances, or of the UUIDs.
void measure_presence_row(const PresenceOptions& options);

}  // namespace millrace::bench
