// The result of a computation of an NC program: a value, or the fault that aborts the program.
#pragma once

#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include <tl/expected.hpp>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/variable_info.hpp"

namespace millrace::cnc::nc::values {

template <class T>
using Result = tl::expected<T, Fault>;

/// A fault with the kernel's error id (0 = none documented).
[[nodiscard]] inline tl::unexpected<Fault> fault(int id, std::string text) {
  return tl::make_unexpected(Fault{id, std::move(text)});
}

/// A fault that aborts the running program; thrown below Channel::tick.
struct Aborted : std::runtime_error {
  explicit Aborted(Fault why) : std::runtime_error(why.text), fault(std::move(why)) {}
  Fault fault;
};

[[noreturn]] inline void fail(int id, std::string text) {
  throw Aborted({id, std::move(text)});
}

/// The value; a fault aborts the program.
template <class T>
T must(Result<T> result) {
  if (!result) {
    throw Aborted(std::move(result.error()));
  }
  if constexpr (!std::is_void_v<T>) {
    return *std::move(result);
  }
}

/// `value`, or fault 21883 if it is infinite or NaN.
[[nodiscard]] inline Result<Value> finite(double value) {
  if (!std::isfinite(value)) {
    return fault(21883, "overflow: the result does not fit a REAL64");
  }
  return value;
}

// Converts a Value to the type that an operation needs. The language has no implicit conversion: a
// string in place of a number is an error, and the reverse (IB/tf5200_diagnosis, errors 21460 and
// 21461).

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

// The types of variables, and the values that fit them.

/// Finds a type by its name in the language, case-insensitive: "UNS32". STRING is recognised by its
/// brackets, not here.
[[nodiscard]] std::optional<VariableType> find_type(std::string_view name);
/// For example "SGN16", "STRING[20]".
[[nodiscard]] std::string type_name(const VariableShape& shape);
/// 0 or "".
[[nodiscard]] Value initial_value(const VariableShape& shape);
/// The value as the type stores it: integers rounded, booleans 0 or 1. Faults: 21460 and 21461 for
/// the wrong kind, 21462 for a string that is too long, 21883 for a number out of range.
[[nodiscard]] Result<Value> fit(const VariableShape& shape, const Value& value);

}  // namespace millrace::cnc::nc::values
