// Times, durations and sizes as text for people.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"

namespace millrace::tools::print {

/// "2026-03-01T07:00:00.123456Z"; "-" for a time that is not known.
std::string time_text(fabric::Time time);
/// "07:00:00.123456Z".
std::string clock_text(fabric::Time time);
/// Three digits and a unit: "1.23 ms", "45.6 s"; from a minute on as age_text().
std::string duration_text(std::chrono::nanoseconds duration);
/// In whole seconds, two units: "12s", "1m57s", "2h05m", "3d04h".
std::string age_text(std::chrono::nanoseconds age);
/// "1.2 MiB".
std::string size_text(std::uint64_t bytes);

/// "500", "64KiB", "1.5GiB"; also k, M and G for powers of 1000.
tl::expected<std::uint64_t, std::string> parse_size(std::string_view text);

}  // namespace millrace::tools::print
