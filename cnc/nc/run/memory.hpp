// The parameters and variables of a channel's programs, each kind with its life time
// (IB/tf5200_programming_manual/207966475, 207973899 and 486123531). From outside, by name, and by
// index for clients that list them (ADS does both):
//
//   const Memory& variables = channel.variables();
//   for (std::size_t i = 0; i < variables.count(VariableFamily::program); ++i)
//     show(variables.info(VariableFamily::program, i)->name);      // "V.P.COUNTER"
//   auto value = variables.read("V.P.TABLE[2][0]");
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "cnc/nc/run/variable_table.hpp"
#include "cnc/nc/variable_info.hpp"

namespace millrace::cnc::nc::run {

/// The arguments of a cycle, by number: @P1.
using CycleArguments = std::map<long, Value>;

class Memory {
 public:
  Memory();

  /// A main program starts: deletes all variables except V.S.
  void start_program();
  /// A subprogram begins or ends; a cycle has arguments.
  void enter_level(std::optional<CycleArguments> arguments);
  void leave_level();

  /// True for the variables stored here (P, V.P, V.L, V.S, V.CYC).
  [[nodiscard]] static bool owns(std::string_view name);
  /// An assignment of a program, which creates single P, V.P and V.S.
  values::Result<void> assign(std::string_view name, const Value& value);
  /// A line of #VAR.
  values::Result<void> declare(std::string_view name, const VariableShape& shape,
                               std::span<const Value> initial);
  /// #DELETE
  values::Result<void> erase(std::string_view name);
  /// @P<number> of the innermost cycle; null if it was not passed.
  [[nodiscard]] const Value* cycle_argument(long number) const;

  /// The number of variables that a family has at present.
  [[nodiscard]] std::size_t count(VariableFamily family) const;
  /// The variables of a family by index from 0, in the order of their names.
  [[nodiscard]] std::optional<VariableInfo> info(VariableFamily family, std::size_t index) const;
  /// By name, without or with indices.
  [[nodiscard]] std::optional<VariableInfo> find(std::string_view name) const;
  /// A single value or an element of an array; a fault if the name is unknown.
  [[nodiscard]] values::Result<Value> read(std::string_view name) const;
  /// Writes a value; creates no variable. Faults as for an assignment in a program.
  values::Result<void> overwrite(std::string_view name, const Value& value);
  /// True if a variable, or an element of an array, has this name.
  [[nodiscard]] bool exists(std::string_view name) const;

 private:
  struct Level {
    VariableTable locals;
    VariableTable cycle;
    std::optional<CycleArguments> arguments;
  };
  [[nodiscard]] static std::optional<VariableFamily> family_of(std::string_view name);
  /// The table that has this name, or in which it would be created.
  [[nodiscard]] const VariableTable& table_of(VariableFamily family, std::string_view name) const;
  [[nodiscard]] VariableTable& table_of(VariableFamily family, std::string_view name);

  VariableTable parameters_;
  VariableTable program_;
  VariableTable self_;
  /// The main program first.
  std::vector<Level> levels_;
};

}  // namespace millrace::cnc::nc::run
