// External access to the variables that NC programs create: by name, and by index for clients that
// list them (ADS does both).
//
//   VariableDirectory& variables = channel.variables();
//   for (std::size_t i = 0; i < variables.count(VariableFamily::program); ++i)
//     show(variables.info(VariableFamily::program, i)->name);      // "V.P.COUNTER"
//   auto value = variables.read("V.P.TABLE[2][0]");
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/environment.hpp"

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

class VariableDirectory {
 public:
  virtual ~VariableDirectory() = default;

  /// The number of variables that a family has at present.
  [[nodiscard]] virtual std::size_t count(VariableFamily family) const = 0;
  /// The variables of a family by index from 0, in the order of their names.
  [[nodiscard]] virtual std::optional<VariableInfo> info(VariableFamily family,
                                                         std::size_t index) const = 0;
  /// By name, without or with indices.
  [[nodiscard]] virtual std::optional<VariableInfo> find(std::string_view name) const = 0;
  /// A single value or an element of an array; a fault if the name is unknown.
  [[nodiscard]] virtual tl::expected<Value, Fault> read(std::string_view name) const = 0;
  /// Writes a value; creates no variable. Faults as for an assignment in a program.
  virtual tl::expected<void, Fault> overwrite(std::string_view name, const Value& value) = 0;
};

}  // namespace millrace::cnc::nc
