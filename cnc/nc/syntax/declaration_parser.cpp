
#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/parsers.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr std::size_t most_initial_values = 4096;  // the most that fit into a block

// STRING, STRING[20] or STRING[P3]
void parse_string_type(Cursor& cursor, Declaration& declaration) {
  declaration.type = VariableType::string;
  if (!cursor.accept("[")) {
    return;
  }
  const Token token = cursor.peek();
  declaration.length = parse_expression(cursor);
  const auto* const length = std::get_if<Number>(&declaration.length->node);
  if (length != nullptr && !(length->value >= 0 && length->value <= longest_string)) {
    cursor.fail_at(token, "the length of a string is 0 to " + std::to_string(longest_string));
  }
  cursor.expect("]");
}

void parse_type(Cursor& cursor, Declaration& declaration) {
  if (cursor.accept_word("STRING")) {
    parse_string_type(cursor, declaration);
  } else if (cursor.accept_word("REAL")) {  // IB/tccncprogramming/15557118091
    declaration.type = VariableType::real64;
  } else if (const auto type = values::find_type(cursor.peek().text)) {
    cursor.take();
    declaration.type = *type;
  } else {
    cursor.fail_unknown("unknown type " + describe(cursor.peek()) +
                        "; types are BOOLEAN SGN08 UNS08 SGN16 UNS16 SGN32 UNS32 REAL64 STRING[n]");
  }
}

// [1, 2], or nested by rows: [[1, 2], [3, 4]]. A line that ends with a comma goes on, as in the
// vendor's editor.
void parse_list(Cursor& cursor, std::vector<Expression>& list) {
  cursor.expect("[");
  if (!cursor.enter()) {
    return;
  }
  bool behind_comma = false;
  do {
    cursor.continue_brackets(behind_comma);
    behind_comma = true;
    if (cursor.peek().is("[")) {
      parse_list(cursor, list);
    } else if (list.size() < most_initial_values) {
      list.push_back(parse_expression(cursor));
    }
    cursor.continue_brackets();
  } while (cursor.accept(",") && !cursor.failed());
  cursor.leave();
  cursor.expect("]");
}

bool is_array(const Reference& reference) {
  if (const auto* parameter = std::get_if<Parameter>(&reference)) {
    return !parameter->elements.empty();
  }
  const auto* variable = std::get_if<Variable>(&reference);
  return variable != nullptr && !variable->parts.back().elements.empty();
}

// [3, 4] and not [3 + 4] * 2.
bool at_list(const Cursor& cursor) {
  if (!cursor.peek().is("[")) {
    return false;
  }
  constexpr int farthest = 100;
  int depth = 1;
  for (int count = 1; depth > 0 && count < farthest; ++count) {
    const Token token = cursor.peek_ahead(count);
    if (token.ends_block() || (depth == 1 && token.is(","))) {
      return !token.ends_block();
    }
    depth += token.is("[") ? 1 : 0;
    depth -= token.is("]") ? 1 : 0;
  }
  return false;
}

Declaration parse_declaration(Cursor& cursor) {
  Declaration declaration;
  declaration.variable = parse_reference(cursor);
  if (cursor.accept(":")) {
    parse_type(cursor, declaration);
  }
  if (!cursor.accept("=")) {
    return declaration;
  }
  if (!is_array(declaration.variable) && at_list(cursor)) {
    const Token list = cursor.peek();
    parse_list(cursor, declaration.initial);
    // The vendor's editor reads it; what it means is not documented.
    cursor.fail_unknown_at(list, "an array is declared with its sizes, NAME[3]");
    return declaration;
  }
  if (!is_array(declaration.variable)) {
    declaration.initial.push_back(parse_expression(cursor));
    return declaration;
  }
  do {
    parse_list(cursor, declaration.initial);
  } while (cursor.accept(",") && !cursor.failed());
  return declaration;
}

void skip_block_number(Cursor& cursor) {
  if (cursor.peek().kind == TokenKind::name && upper(cursor.peek().text.front()) == 'N') {
    cursor.take_letter();
    static_cast<void>(parse_word_value(cursor));
  }
}

}  // namespace

Statement parse_declarations(Cursor& cursor) {
  Declarations declarations;
  const Token begin = cursor.peek();
  while (true) {
    cursor.next_block();
    skip_block_number(cursor);
    if (cursor.at_program_end()) {
      cursor.report(begin.line, begin.column, "#VAR without #ENDVAR");
      return declarations;
    }
    if (at_reference(cursor)) {
      declarations.variables.push_back(parse_declaration(cursor));
    } else if (!cursor.at_block_end()) {
      const bool command = cursor.accept("#");
      if (command && cursor.at_word("COMMENT")) {
        parse_comment(cursor);
        continue;
      }
      if (!command || !cursor.accept_word("ENDVAR")) {
        cursor.fail("a declaration or #ENDVAR expected before " + describe(cursor.peek()));
      }
      return declarations;
    }
  }
}

Statement parse_deletion(Cursor& cursor) {
  Deletion deletion;
  do {
    if (!at_reference(cursor)) {
      cursor.fail("a variable expected before " + describe(cursor.peek()));
      break;
    }
    deletion.variables.push_back(parse_reference(cursor));
  } while (cursor.accept(","));
  return deletion;
}

}  // namespace millrace::cnc::nc::syntax
