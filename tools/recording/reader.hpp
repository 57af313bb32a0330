// Reads the entries of a recording, correct or damaged: of an MCAP file, or of an LCM log in which
// millrace-lcm has mirrored a fabric.
//
//   const ReadReport report = read_entries(source, filter, [&](const Entry& entry) { … });
#pragma once

#include <cstdint>
#include <functional>

#include "tools/mcap/problem.hpp"
#include "tools/mcap/sink.hpp"
#include "tools/recording/entry.hpp"
#include "tools/recording/filter.hpp"

namespace millrace::tools::recording {

struct ReadReport {
  /// The unreadable parts, with their places in the file.
  mcap::Problems problems{};
  /// Messages of foreign schemas.
  std::uint64_t foreign = 0;
};

/// Passes the entries that pass `filter` to `use`, in the order of the file. Chunks outside of the
/// filter's time are not read.
ReadReport read_entries(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use);

}  // namespace millrace::tools::recording
