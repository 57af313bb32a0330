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
  /// The file being written; nullopt while the recorder waits, for a failure or for space.
  std::optional<std::filesystem::path> writes{};
  bool waits_for_room = false;
  /// The free space on the disk, if it was read; the reserved space; and whether older files are
  /// removed for it.
  std::optional<std::uint64_t> free{};
  std::uint64_t minimum_free = 0;
  bool makes_room = false;
  /// The samples that DDS reports as lost, and those that calls show to be missing.
  std::uint64_t lost = 0;
  recording::Missing missing{};
};

/// All present alarms; others are over. Their kinds: "recording" (always), "disk", "missing".
std::vector<fabric::Alarm> alarms_of(const Condition& condition);

}  // namespace millrace::tools::recorder
