// What a computation of an NC program gives: a value, or the fault that aborts the program.
#pragma once

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

}  // namespace millrace::cnc::nc::values
