// The formats of #MSG: %d %u %f %s as in printf, with flags, width and precision, in either case;
// %% is a percent sign (IB/tccncprogramming/15556947595; width and precision are our choice).
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {

/// A piece of a format: literal text, or a conversion.
struct FormatPiece {
  std::string literal;
  /// 'd', 'u', 'f', 's', or 0 for a literal.
  char conversion = 0;
  bool left = false;
  bool zeros = false;
  bool plus = false;
  int width = 0;
  int precision = -1;
};

/// The pieces of a format; fault 20721 for an unknown or unfinished conversion.
[[nodiscard]] Result<std::vector<FormatPiece>> parse_format(std::string_view format);
/// The number of values that a format needs.
[[nodiscard]] std::size_t conversions(const std::vector<FormatPiece>& pieces);
/// The text with its values. Faults: 20721 for a wrong number of values, 21460 and 21461 for a
/// value of the wrong type (%s accepts numbers too, as the vendor's samples use it).
[[nodiscard]] Result<std::string> format(std::string_view format, std::span<const Value> values);

}  // namespace millrace::cnc::nc::values
