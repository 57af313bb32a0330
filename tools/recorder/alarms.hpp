// The alarms of a recorder: that it records, and its problems. Pure.
//
//   for (const fabric::Alarm& alarm : alarms_of(condition)) …
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "fabric/alarm.hpp"
#include "tools/recording/completeness.hpp"

namespace millrace::tools::recorder {

struct Condition {
  /// As configured (options.hpp).
  std::filesystem::path file{};
  /// The one that is written; nothing while it waits, for a failure or for room.
  std::optional<std::filesystem::path> writes{};
  bool waits_for_room = false;
  /// On the disk, if it was looked at; what must be left; and whether older files are removed for
  /// it.
  std::optional<std::uint64_t> free{};
  std::uint64_t minimum_free = 0;
  bool makes_room = false;
  /// The samples that DDS reports as lost, and those that calls show to be missing.
  std::uint64_t lost = 0;
  recording::Missing missing{};
};

/// All that holds now; what is not among them any more does not hold any more. Their kinds:
/// "recording" (always), "disk", "missing".
std::vector<fabric::Alarm> alarms_of(const Condition& condition);

}  // namespace millrace::tools::recorder
