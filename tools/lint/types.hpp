// Finds a number where the Service Interface holds a text, and a text where it holds a number.
// Pure.
//
//   const Types types(program);
//   types.mistakes(operation.statement)    // {"REQUEST is a text, and a number is assigned to it …"}
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/nc/syntax/program.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::tools::lint {

namespace syntax = cnc::nc::syntax;

class Types {
 public:
  /// A text that names a macro of the program may mean anything.
  explicit Types(const syntax::Program& program);

  /// Only those about V.G.SERVICE, and only certain ones: the controller would abort the program
  /// there.
  [[nodiscard]] std::vector<std::string> mistakes(const syntax::Statement& statement) const;

 private:
  std::set<std::string> macros_;
};

// The value of a condition of an NC program while its request has no response yet. Pure.
//
//   truth_at(condition, syntax::ConditionRule::above_half, 0)    // true: over before there is an answer
//   can_be_true(condition, rule)                         // false: no answer ever ends this wait

namespace syntax = cnc::nc::syntax;

/// Is the condition true while RESPONSE_STATE is `state`? Nullopt if that depends on anything else.
std::optional<bool> truth_at(const syntax::Expression& condition, syntax::ConditionRule rule,
                             double state);

/// False if it is certain that no response makes it true.
bool can_be_true(const syntax::Expression& condition, syntax::ConditionRule rule);

/// "REQUEST" for V.G.SERVICE.REQUEST; empty for every other variable.
std::string_view service_part(const syntax::Variable& variable);

}  // namespace millrace::tools::lint
