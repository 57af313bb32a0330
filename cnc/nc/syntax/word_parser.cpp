#include "cnc/nc/syntax/word_parser.hpp"

#include <array>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/call_parser.hpp"
#include "cnc/nc/syntax/expression_parser.hpp"
#include "cnc/nc/syntax/system_data_parser.hpp"

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
      cursor.fail_at(whole, "unknown word " + describe(whole));
    }
    return word;
  }
  if (addresses.find(word.address) == std::string_view::npos ||
      (cursor.peek().adjacent && !is_word_value(cursor))) {
    cursor.fail_at(whole, "unknown word " + describe(whole));
    return word;
  }
  if (word.address == "M" && cursor.peek().kind == TokenKind::number) {
    // Without operators, so that the text after M30 can be checked.
    word.value = parse_word_value(cursor);
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

bool is_dwell(const Word& word) {
  const auto* number = std::get_if<Number>(&word.value.node);
  return word.address == "G" && number != nullptr && number->value == 4;
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
    } else if (cursor.peek().kind == TokenKind::name) {
      Word word = parse_word(cursor);
      const bool dwell = is_dwell(word);
      words.items.emplace_back(std::move(word));
      if (dwell && at_bare_value(cursor)) {
        words.items.emplace_back(Word{"", parse_word_value(cursor)});
      }
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

}  // namespace millrace::cnc::nc::syntax
