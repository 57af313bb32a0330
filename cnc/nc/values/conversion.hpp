// Converts a Value to the type that an operation needs. The language has no implicit conversion: a
// string in place of a number is an error, and the reverse (IB/tf5200_diagnosis, errors 21460 and
// 21461).
#pragma once

#include <string>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {

/// The number in a value, otherwise fault 21461 "number expected".
[[nodiscard]] Result<double> number(const Value& value);
/// The string in a value, otherwise fault 21460 "string expected".
[[nodiscard]] Result<std::string> text(const Value& value);
/// The number rounded to an integer; fault 21461 for a string, 21883 beyond ±2^53.
[[nodiscard]] Result<long> integer(const Value& value);
/// A value as text for #MSG with %s or a log: "3", "0.5".
[[nodiscard]] std::string display(const Value& value);

/// $IF, $WHILE, && and ||: |value| >= 0.5 (IB/tf5200_programming_manual/206901003, documented).
[[nodiscard]] bool is_true(double value);

}  // namespace millrace::cnc::nc::values
