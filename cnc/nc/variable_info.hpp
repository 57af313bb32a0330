// The variables that NC programs create, as others see them.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace millrace::cnc::nc {

/// P (parameters), V.L (local to a program level), V.P (until the program's end), V.S (until the
/// controller stops), V.CYC (a level and those below it).
enum class VariableFamily { parameter, local, program, self, cycle };

enum class VariableType { boolean, sgn08, uns08, sgn16, uns16, sgn32, uns32, real64, string };

/// The type of a variable, from its declaration in the language or elsewhere.
struct VariableShape {
  VariableType type = VariableType::real64;
  /// STRING[n]: the most characters, without the NUL.
  std::size_t length = 0;
  /// Sizes of an array's dimensions; empty for a single value.
  std::vector<std::size_t> dimensions;

  bool operator==(const VariableShape&) const = default;
};

struct VariableInfo {
  /// Without indices: "V.P.TABLE", "P12".
  std::string name;
  VariableShape shape;
};

}  // namespace millrace::cnc::nc
