// What instances cost that have nothing to do: processes of one UUID and a gateway on one host, and
// raw Cyclone with as many peers.
#pragma once

#include <cstdint>
#include <vector>

namespace millrace::bench {

struct PresenceOptions {
  /// Service processes of each row.
  std::vector<std::uint32_t> instances{10, 30, 50, 100, 200};
  /// How long their processor time is counted. A participant speaks up every 8 s if its lease is 10
  /// s, every 24 s if it is 30 s: whole rounds, since that is most of what there is.
  std::uint32_t idle_seconds = 24;
  /// If not 0, something else is measured: one process with so many UUIDs.
  std::uint32_t uuids = 0;
  /// Two hundred raw processes take both cores for minutes.
  bool without_raw = false;
};

/// All rows, each in a process of its own. True if the goals are met.
bool measure_presence(const PresenceOptions& options);
/// The one row of the first number of instances, or of the UUIDs.
void measure_presence_row(const PresenceOptions& options);

}  // namespace millrace::bench
