// Lengths as whole nanometres: every step of a dial gauge, metric or inch, is exact.
//
//   parse_length("+00000011.88", Unit::mm) == 11'880'000
//   to_text(11'880'000, 3) == "11.880 mm"
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::services::dial_gauge {

using Nanometres = std::int64_t;

inline constexpr Nanometres nanometres_per_mm = 1'000'000;
inline constexpr Nanometres nanometres_per_inch = 25'400'000;

enum class Unit : std::uint8_t { mm, inch };

/// A sign, digits and at most one point: 1 to 12 digits, up to 6 of them decimals. No other
/// characters, not even a blank.
std::optional<Nanometres> parse_length(std::string_view text, Unit unit);

/// In mm, rounded half away from zero to `decimals` (0 to 6), with its unit: "-0.005 mm".
std::string to_text(Nanometres length, unsigned decimals);

/// Rounds to the nearest multiple of `step` nanometres (> 0).
Nanometres quantised(double nanometres, Nanometres step);

}  // namespace millrace::services::dial_gauge
