#include "cnc/nc/syntax/system_data_parser.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "cnc/nc/syntax/expression_parser.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

// SD.NAME
Variable parse_target(Cursor& cursor) {
  const Token token = cursor.peek();
  if (at_reference(cursor)) {
    Reference reference = parse_reference(cursor);
    if (is_system_data(reference)) {
      return std::get<Variable>(std::move(reference));
    }
  }
  cursor.fail_at(token, "system data expected, SD.NAME, before " + describe(token));
  return {};
}

// The operand of SSD: a value or a variable, optionally with a sign (documented; which expressions
// are simple is our reading).
bool is_simple(const Expression& value) {
  if (const auto* unary = std::get_if<Unary>(&value.node)) {
    return unary->operation == UnaryOperator::minus && is_simple(*unary->operand);
  }
  return !std::holds_alternative<Binary>(value.node) && !std::holds_alternative<Call>(value.node) &&
         !std::holds_alternative<Query>(value.node);
}

WordsItem parse_assignment(Cursor& cursor, bool any) {
  cursor.expect("[");
  DataAssignment assignment{parse_target(cursor), {}};
  cursor.expect("=");
  const Token token = cursor.peek();
  assignment.value = parse_expression(cursor);
  if (!any && !cursor.failed() && !is_simple(assignment.value)) {
    cursor.fail_at(token, "SSD assigns a value or a variable; an expression is assigned with SSDE");
  }
  cursor.expect("]");
  return assignment;
}

WordsItem parse_ssd(Cursor& cursor) {
  return parse_assignment(cursor, false);
}

WordsItem parse_ssde(Cursor& cursor) {
  return parse_assignment(cursor, true);
}

WordsItem parse_ssdq(Cursor& cursor) {
  cursor.expect("[");
  QueueMessage message;
  message.queue = parse_target(cursor);
  cursor.expect(",");
  message.control = parse_target(cursor);
  cursor.expect(",");
  message.value = parse_expression(cursor);
  cursor.expect("]");
  return message;
}

WordsItem parse_ssdq_init(Cursor& cursor) {
  cursor.expect("[");
  QueueInit init{parse_target(cursor)};
  cursor.expect("]");
  return init;
}

struct Rule {
  std::string_view word;
  WordsItem (*parse)(Cursor&);
};
constexpr std::array<Rule, 4> rules = {{
    {"SSD", parse_ssd},
    {"SSDE", parse_ssde},
    {"SSDQ", parse_ssdq},
    {"SSDQINIT", parse_ssdq_init},
}};

const Rule* rule_at(const Cursor& cursor) {
  const auto* found = std::find_if(rules.begin(), rules.end(),
                                   [&](const Rule& rule) { return cursor.at_word(rule.word); });
  return found == rules.end() ? nullptr : found;
}

}  // namespace

bool at_system_data(const Cursor& cursor) {
  return rule_at(cursor) != nullptr;
}

WordsItem parse_system_data(Cursor& cursor) {
  const Rule& rule = *rule_at(cursor);
  cursor.take();
  return rule.parse(cursor);
}

bool is_system_data(const Reference& reference) {
  const auto* variable = std::get_if<Variable>(&reference);
  return variable != nullptr && !variable->parts.empty() && variable->parts.front().name == "SD";
}

}  // namespace millrace::cnc::nc::syntax
