// What of a machine's variables may be written over the fabric. Pure.
//
//   WriteRules rules{{"V.E.*"}, {"V.P.OFFSET", {2}}};
//   objection(rules, 1, "V.P.OFFSET")     → why not; empty if it may
//
// Nothing unless a rule names it, and V.G.SERVICE.* never, whatever rules say and however it is
// spelled: what stands there belongs to the program and its gateway.
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
  /// What questions about variables may ask of the controller; calls and data have theirs besides.
  double requests_per_second = 100;
  /// What was read so lately is an answer too.
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
