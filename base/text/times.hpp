// Times and spans as people type them, the same at every program.
//
//   parse_time_span("15m")                    // 15 minutes
//   parse_time("2026-03-01T07:00", now)       // UTC
//   parse_time("12h", now)                    // twelve hours before now
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::base::text {

using Time = std::chrono::sys_time<std::chrono::nanoseconds>;

/// A number, perhaps with a fraction, and ns, us, ms, s, m or min, h, d: "250ms", "1.5 h", "7d". A
/// number alone is seconds. The error says what was expected.
tl::expected<std::chrono::nanoseconds, std::string> parse_time_span(std::string_view text);

/// A point in UTC: "2026-03-01", "2026-03-01T07:00", "2026-03-01T07:00:00.5", perhaps with a Z; or
/// so long before `now`, a span with its unit. The error says what was expected.
tl::expected<Time, std::string> parse_time(std::string_view text, Time now);

}  // namespace millrace::base::text
