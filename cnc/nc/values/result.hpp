// The result of a computation of an NC program: a value, or the fault that aborts the program.
#pragma once

#include <cmath>
#include <string>
#include <utility>

#include <tl/expected.hpp>

#include "cnc/nc/environment.hpp"

namespace millrace::cnc::nc::values {

template <class T>
using Result = tl::expected<T, Fault>;

/// A fault with the kernel's error id (0 = none documented).
[[nodiscard]] inline tl::unexpected<Fault> fault(int id, std::string text) {
  return tl::make_unexpected(Fault{id, std::move(text)});
}

/// `value`, or fault 21883 if it is infinite or NaN.
[[nodiscard]] inline Result<Value> finite(double value) {
  if (!std::isfinite(value)) {
    return fault(21883, "overflow: the result does not fit a REAL64");
  }
  return value;
}

}  // namespace millrace::cnc::nc::values
