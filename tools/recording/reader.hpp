// Reads the entries of a recording, correct or damaged: of an MCAP file, or of an LCM log in which
// millrace-lcm has mirrored a fabric.
//
//   const ReadReport report = read_entries(source, filter, [&](const Entry& entry) { … });
#pragma once

#include <cstdint>
#include <functional>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"
#include "tools/recording/entry.hpp"

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

// A log of LCM's lcm-logger with the messages that millrace-lcm mirrors: read as a recording.
//
// Each event is the sync word ED A1 DA 01, its number and time (64 bits each), the lengths of
// channel and message (32 bits each), all of big endian, the channel, the message (liblcm 1.3,
// eventlog.c).

/// Whether it begins as such a log.
bool is_lcm_log(mcap::Source& source);

/// As read_entries(). After a damaged place it continues with the next event. Messages of other
/// programs are counted as foreign.
ReadReport read_lcm_log(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use);

}  // namespace millrace::tools::recording
