// The operators between values (IB/tf5200_programming_manual/206014219).
#pragma once

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

}  // namespace millrace::cnc::nc::values
