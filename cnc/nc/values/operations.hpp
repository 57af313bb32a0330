// The operators between values, and the functions (IB/tf5200_programming_manual/206014219).
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {

enum class BinaryOperator {
  logical_or,
  logical_xor,
  logical_and,
  bit_or,
  bit_xor,
  bit_and,
  equal,
  not_equal,
  less,
  less_or_equal,
  greater,
  greater_or_equal,
  add,
  subtract,
  multiply,
  divide,
  modulo,
  power
};

/// Comparisons and logic return 1 or 0. `+` joins two strings; strings compare byte by byte.
/// Faults: 20396 division by zero, 20574 the same in MOD, 21460 and 21461 mixed types, 21883
/// overflow.
[[nodiscard]] Result<Value> apply(BinaryOperator operation, const Value& left, const Value& right);

// The functions of the language by name, in two tables: number_functions.cpp and
// string_functions.cpp. Angles are in degrees (IB/tf5200_programming_manual/206014219, 206023179).

using Arguments = std::span<const Value>;

struct Function {
  /// In upper case.
  std::string_view name;
  std::size_t least_arguments;
  std::size_t most_arguments;
  Result<Value> (*call)(Arguments);
};

[[nodiscard]] std::span<const Function> number_functions();
[[nodiscard]] std::span<const Function> string_functions();

/// True for a function of strings.
[[nodiscard]] bool is_string_function(const Function& function);

/// Finds a function by name, case-insensitive; null if there is none.
[[nodiscard]] const Function* find_function(std::string_view name);

}  // namespace millrace::cnc::nc::values
