#include <algorithm>
#include <array>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/manual.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {

namespace {

constexpr std::string_view addresses = "GMFSTDHEIJKRABCQUVWXYZ";
// The first letters of axis names (inferred from the examples of the manuals).
constexpr std::string_view axis_letters = "ABCQUVWXYZ";
// After an @, in a cycle: the main axes and the spindle, whatever their names.
constexpr std::string_view cycle_addresses = "XYZIJKS";

struct AssignmentRule {
  std::string_view spelling;
  std::optional<values::BinaryOperator> operation;
};
constexpr std::array<AssignmentRule, 5> assignment_rules = {{
    {"=", std::nullopt},
    {"+=", values::BinaryOperator::add},
    {"-=", values::BinaryOperator::subtract},
    {"*=", values::BinaryOperator::multiply},
    {"/=", values::BinaryOperator::divide},
}};

Assignment parse_assignment(Cursor& cursor) {
  Assignment assignment;
  const Token target = cursor.peek();
  assignment.target = parse_reference(cursor);
  if (is_system_data(assignment.target)) {
    cursor.fail_at(target, "system data are assigned with SSD[SD.NAME = value]");
    return assignment;
  }
  for (const AssignmentRule& rule : assignment_rules) {
    if (cursor.accept(rule.spelling)) {
      assignment.operation = rule.operation;
      assignment.value = parse_expression(cursor);
      return assignment;
    }
  }
  cursor.fail(cursor.peek().is("==") ? "'==' compares; an assignment is written with '='"
                                     : "'=' expected before " + describe(cursor.peek()));
  return assignment;
}

// "NAME" = "text", or "NAME" alone.
WordsItem parse_macro(Cursor& cursor) {
  MacroDefinition macro;
  macro.name = unquote(cursor.take().text);
  if (!cursor.accept("=")) {
    return MacroUse{macro.name};
  }
  if (cursor.peek().kind == TokenKind::string) {
    macro.text = unquote(cursor.take().text);
  } else {
    cursor.fail("the text of the macro \"" + macro.name + "\" expected, in quotation marks");
  }
  return macro;
}

bool is_word_value(const Cursor& cursor) {
  return cursor.peek().kind != TokenKind::name || at_reference(cursor) ||
         values::find_function(cursor.peek().text) != nullptr;
}

// @X100
Word parse_cycle_word(Cursor& cursor) {
  const Token at = cursor.take();
  if (cursor.peek().kind != TokenKind::name ||
      cycle_addresses.find(upper(cursor.peek().text.front())) == std::string_view::npos) {
    cursor.fail_at(at,
                   "behind @ a main axis expected (@X @Y @Z @I @J @K @S); "
                   "the parameters of a cycle (@P1) can only be read");
    return {};
  }
  Word word{'@' + upper(cursor.take_letter().text), {}};
  cursor.accept("=");
  word.value = parse_expression(cursor);
  return word;
}

// G01, G131=50, M30, H5=-345 after the letter: a number, and a value for the PLC or the CNC. The
// number has no operators, so that the text after M30 can be checked.
void parse_function(Cursor& cursor, Word& word) {
  const bool assigned = cursor.accept("=");
  word.value =
      cursor.peek().kind == TokenKind::number ? parse_word_value(cursor) : parse_expression(cursor);
  if (!assigned && cursor.accept("=")) {
    word.argument = parse_expression(cursor);
  }
}

// Z[DIST_CTRL …], S[REV 1000 M03 M63=-789], X[M54=P1]
// (IB/tf5200_programming_manual/5252363631026771979): an axis or a spindle, and no position.
bool at_axis_function(const Cursor& cursor) {
  const Token& token = cursor.peek();
  const char letter = token.kind == TokenKind::name ? upper(token.text.front()) : '\0';
  return (letter == 'S' || axis_letters.find(letter) != std::string_view::npos) &&
         cursor.peek_ahead(1).is("[") && !begins_value(cursor.peek_ahead(2));
}

// The M and H functions are executed, the rest is skipped.
void parse_axis_function(Cursor& cursor, Words& words) {
  const Token axis = cursor.take();
  cursor.expect("[");
  Skipped skipped;
  int depth = 1;
  while (!cursor.at_block_end()) {
    if (at_machine_function(cursor)) {
      Word word{upper(cursor.take_letter().text), {}};
      parse_function(cursor, word);
      words.items.emplace_back(std::move(word));
      continue;
    }
    depth += cursor.peek().is("[") ? 1 : 0;
    depth -= cursor.peek().is("]") ? 1 : 0;
    if (depth == 0) {
      break;
    }
    const Token token = cursor.take();
    if (skipped.name.empty()) {
      skipped.name = std::string(axis.text) + '[' + std::string(token.text) + " ...]";
    }
  }
  cursor.expect("]");
  if (!skipped.name.empty()) {
    words.items.emplace_back(std::move(skipped));
  }
}

// X10, X=10, X1=10 (an axis whose name ends with a digit), X_ACHSE=10 (an axis with a longer name).
Word parse_word(Cursor& cursor) {
  const Token whole = cursor.peek();
  const Token letter = cursor.take_letter();
  Word word{upper(letter.text), {}};
  if (axis_letters.find(word.address) != std::string_view::npos && cursor.peek().adjacent &&
      !is_word_value(cursor)) {
    const Token rest = cursor.take();
    if (cursor.accept("=")) {
      word.address += upper(rest.text);
      word.value = parse_expression(cursor);
    } else {
      cursor.fail_unknown_at(whole, "unknown word " + describe(whole));
    }
    return word;
  }
  if (addresses.find(word.address) == std::string_view::npos ||
      (cursor.peek().adjacent && !is_word_value(cursor))) {
    cursor.fail_unknown_at(whole, "unknown word " + describe(whole));
    return word;
  }
  if (word.address == "G" || word.address == "M" || word.address == "H") {
    parse_function(cursor, word);
    return word;
  }
  const Token first = cursor.peek();
  const bool assigned = cursor.accept("=");
  word.value = parse_expression(cursor);
  if (!assigned && first.kind == TokenKind::number && first.adjacent && cursor.accept("=")) {
    word.address += first.text;
    word.value = parse_expression(cursor);
  }
  return word;
}

// The number of a G function that is a constant; null for other words.
const Number* function_of(const Word& word) {
  return word.address == "G" ? std::get_if<Number>(&word.value.node) : nullptr;
}

bool is_program_end(const Words& words) {
  const auto* word = words.items.empty() ? nullptr : std::get_if<Word>(&words.items.back());
  const auto* number = word == nullptr ? nullptr : std::get_if<Number>(&word->value.node);
  return number != nullptr && word->address == "M" && number->value == 30;
}

bool at_bare_value(const Cursor& cursor) {
  return cursor.peek().kind == TokenKind::number || cursor.peek().is("[") || at_reference(cursor);
}

}  // namespace

Words parse_words(Cursor& cursor) {
  Words words;
  while (!cursor.at_block_end() && !cursor.peek().is("$") && !at_call(cursor)) {
    if (at_system_data(cursor)) {
      words.items.push_back(parse_system_data(cursor));
    } else if (cursor.peek().is("@")) {
      words.items.emplace_back(parse_cycle_word(cursor));
    } else if (at_reference(cursor)) {
      words.items.emplace_back(parse_assignment(cursor));
    } else if (cursor.peek().kind == TokenKind::string) {
      words.items.push_back(parse_macro(cursor));
    } else if (at_axis_function(cursor)) {
      parse_axis_function(cursor, words);
    } else if (cursor.peek().kind == TokenKind::name) {
      const Token token = cursor.peek();
      Word word = parse_word(cursor);
      const Number* const function = function_of(word);
      if (function != nullptr && calls_subprogram(function->value) && cursor.peek().is("[")) {
        cursor.skip_brackets();  // G800[1, 2]: arguments
      } else if (function != nullptr && takes_values(function->value) && at_bare_value(cursor)) {
        words.items.emplace_back(std::move(word));
        word = {"", parse_word_value(cursor)};
      } else if (function != nullptr && cursor.peek().is("[")) {
        cursor.fail_unknown_at(token, "unknown word " + describe(token) + " with brackets");
      }
      words.items.emplace_back(std::move(word));
    } else if (cursor.peek().is("/") && is_program_end(words)) {
      const Token slash = cursor.take();
      words.misprinted_end = true;
      if (!cursor.at_block_end()) {
        cursor.fail_at(slash, describe(slash) + " is not expected here");
      }
    } else {
      cursor.fail(cursor.peek().is("#") ? "a # command must be alone in its block"
                                        : describe(cursor.peek()) + " is not expected here");
    }
  }
  return words;
}

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
