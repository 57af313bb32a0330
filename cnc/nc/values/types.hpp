// The types of variables, and the values that fit them.
#pragma once

#include <optional>
#include <string_view>

#include "cnc/nc/values/result.hpp"
#include "cnc/nc/variable_directory.hpp"

namespace millrace::cnc::nc::values {

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
