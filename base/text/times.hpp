// Times and durations as people type them, with the same syntax in every process.
//
//   parse_time_span("15m")                    // 15 minutes
//   parse_time("2026-03-01T07:00", now)       // UTC
//   parse_time("12h", now)                    // twelve hours before now
#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::base::text {

using Time = std::chrono::sys_time<std::chrono::nanoseconds>;

/// A unit and its factor.
struct Unit {
  std::string_view name;
  double factor;
};
/// A finite number from 0 on with one of these units, or without for `default_factor`, after
/// blanks.
std::optional<double> parse_scaled(std::string_view text, std::span<const Unit> units,
                                   double default_factor);

/// A number, optionally with a fraction, and ns, us, ms, s, m or min, h, d: "250ms", "1.5 h", "7d".
/// A number without unit is seconds. The error contains what was expected.
tl::expected<std::chrono::nanoseconds, std::string> parse_time_span(std::string_view text);

/// A time in UTC: "2026-03-01", "2026-03-01T07:00", "2026-03-01T07:00:00.5", optionally with a Z;
/// or a duration with its unit, which is subtracted from `now`. The error contains what was
/// expected.
tl::expected<Time, std::string> parse_time(std::string_view text, Time now);

}  // namespace millrace::base::text
