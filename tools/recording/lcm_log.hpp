// A log of LCM's lcm-logger with the messages that millrace-lcm mirrors: read as a recording.
//
// Each event is the sync word ED A1 DA 01, its number and time (64 bits each), the lengths of
// channel and message (32 bits each), all of big endian, the channel, the message (liblcm 1.3,
// eventlog.c).
#pragma once

#include <functional>

#include "tools/recording/reader.hpp"

namespace millrace::tools::recording {

/// Whether it begins as such a log.
bool is_lcm_log(mcap::Source& source);

/// As read_entries(). After a damaged place it continues with the next event. Messages of other
/// programs are counted as foreign.
ReadReport read_lcm_log(mcap::Source& source, const Filter& filter,
                        const std::function<void(const Entry&)>& use);

}  // namespace millrace::tools::recording
