// Reads the entries of a recording, correct or damaged: of an MCAP file, or of an LCM log in which
// millrace-lcm has mirrored a fabric.
//
//   const ReadReport report = read_entries(source, filter, [&](const Entry& entry) { … });
#pragma once

#include <cstdint>
#include <functional>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

struct ReadReport {
  /// The unreadable parts, with their places in the file.
  mcap::Problems problems{};
  /// Messages of foreign schemas.
  std::uint64_t foreign = 0;
  /// Whether there was any message, or a chunk outside of the filter's time.
  bool has_read = false;
};

/// Passes the entries that pass `filter` to `use`, in the order of the file. Chunks outside of the
/// filter's time are not read.
ReadReport read_entries(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use);

/// What it holds. A log of LCM has no summary: it is read to its end.
mcap::Survey survey(mcap::Source& source);

}  // namespace millrace::tools::recording
