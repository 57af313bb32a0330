// Which variables of a machine may be written over the fabric. Pure.
//
//   WriteRules rules{{"V.E.*"}, {"V.P.OFFSET", {2}}};
//   objection(rules, 1, "V.P.OFFSET")     → why not; empty if it may
//
// Only those that a rule names, and never V.G.SERVICE.*, in any spelling: these belong to the NC
// program and its gateway.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::gateway::variables {

struct WriteRule {
  /// A name as programs write it, in which '*' stands for any characters: "V.E.*".
  std::string pattern;
  /// Counted from 1; none = all.
  std::vector<std::uint16_t> channels{};
  bool operator==(const WriteRule&) const = default;
};
using WriteRules = std::vector<WriteRule>;

struct VariableSettings {
  WriteRules writable;
  /// The budget of variable requests at the controller; calls and data have their own.
  double requests_per_second = 100;
  /// A value of at most this age is used without a new read: ReadIntervals::active of the machine.
  std::chrono::nanoseconds cycle = std::chrono::milliseconds(2);
  bool operator==(const VariableSettings&) const = default;
};

/// True for V.G.SERVICE and all in it, in any case and with whatever blanks and control characters
/// between: how strictly a controller reads a name is not documented.
bool is_service_interface(std::string_view name);

/// Why the variable may not be written, and what to do; empty if it may.
std::string objection(const WriteRules& rules, std::uint16_t channel, std::string_view name);

/// What is wrong with a pattern of a configuration; empty if nothing is.
std::string wrong_pattern(const std::string& pattern);

}  // namespace millrace::gateway::variables
