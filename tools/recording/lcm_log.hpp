// Logs of LCM's lcm-logger with the messages that millrace-lcm mirrors, as recordings.
//
// Each event is the sync word ED A1 DA 01, its number and time (64 bits each, microseconds), the
// lengths of channel and message (32 bits each), all of big endian, the channel, the message
// (liblcm 1.3, eventlog.c).
#pragma once

#include <functional>

#include "tools/mcap/repair.hpp"
#include "tools/mcap/sink.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::recording {

/// Whether it is such a log. Its first event may be damaged or missing: then an event must begin in
/// the first MiB, and be followed by another one or the end of the file.
bool is_lcm_log(mcap::Source& source);

/// As read_entries(). After a damaged place it continues with the next event. Messages of other
/// programs are counted as foreign.
ReadReport read_lcm_log(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use);

/// Its channels as topics without a schema.
mcap::Survey survey_lcm_log(mcap::Source& source);

/// Copies each whole event to `repaired`. The error is the sink's.
tl::expected<mcap::RepairReport, std::string> repair_lcm_log(mcap::Source& damaged,
                                                             mcap::Sink& repaired);

}  // namespace millrace::tools::recording
