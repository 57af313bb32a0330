#include <algorithm>
#include <array>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr int most_dimensions = 4;
constexpr std::size_t most_parts = 12;
constexpr std::ptrdiff_t most_indirections = 8;

bool is_run_of_p(std::string_view name) {
  return !name.empty() &&
         std::all_of(name.begin(), name.end(), [](char c) { return upper(c) == 'P'; });
}

// [i][j]… after a parameter or a part of a name.
std::vector<Expression> parse_elements(Cursor& cursor) {
  std::vector<Expression> elements;
  while (cursor.peek().is("[") && cursor.peek().adjacent) {
    if (elements.size() == most_dimensions) {
      cursor.fail("an array has at most " + std::to_string(most_dimensions) + " dimensions");
      break;
    }
    cursor.take();
    elements.push_back(parse_expression(cursor));
    cursor.expect("]");
  }
  return elements;
}

Parameter parse_parameter(Cursor& cursor) {
  Parameter parameter;
  const Token run = cursor.take();
  parameter.indirections = static_cast<int>(run.text.size()) - 1;
  if (static_cast<std::ptrdiff_t>(run.text.size()) > most_indirections) {
    cursor.fail_at(run,
                   "a parameter has at most " + std::to_string(most_indirections) + " letters P");
  }
  if (cursor.peek().kind == TokenKind::number) {
    parameter.index = std::make_unique<Expression>(Expression{Number{cursor.take().number}});
  } else if (cursor.accept("[")) {
    parameter.index = std::make_unique<Expression>(parse_expression(cursor));
    cursor.expect("]");
  } else {
    cursor.fail("a parameter needs a number: P12 or P[expression]");
    parameter.index = std::make_unique<Expression>();
  }
  parameter.elements = parse_elements(cursor);
  return parameter;
}

// Records the name without indices, if it is external.
void note_external(Cursor& cursor, const Variable& variable, bool synchronous) {
  if (variable.parts.size() < 3 || variable.parts[0].name != "V" || variable.parts[1].name != "E") {
    return;
  }
  std::string name = variable.parts[0].name;
  for (std::size_t i = 1; i < variable.parts.size(); ++i) {
    name += '.' + variable.parts[i].name;
  }
  cursor.note_external({std::move(name), synchronous});
}

// The members of the Service Interface are fixed (IB/tf5200_service_interface/356533387,
// documented): any other aborts the program on its execution.
void check_service_member(Cursor& cursor, const Token& first, const Variable& variable) {
  constexpr std::array<std::string_view, 5> members{"UUID", "REQUEST", "REQUEST_STATE",
                                                    "RESPONSE_STATE", "RESPONSE"};
  const auto& parts = variable.parts;
  if (parts.size() < 3 || !same_word(parts[1].name, "G") || !same_word(parts[2].name, "SERVICE")) {
    return;
  }
  std::string name = "V";
  bool plain = parts.size() == 4;
  for (std::size_t i = 1; i < parts.size(); ++i) {
    name += '.' + parts[i].name + (parts[i].elements.empty() ? "" : "[…]");
    plain = plain && parts[i].elements.empty();
  }
  const auto meant = std::find_if(members.begin(), members.end(), [&](std::string_view member) {
    return plain && same_word(parts[3].name, member);
  });
  if (meant == members.end()) {
    cursor.doubt_at(first, name +
                               " does not exist; V.G.SERVICE has UUID, REQUEST, REQUEST_STATE, "
                               "RESPONSE_STATE and RESPONSE");
  } else if (const std::string right = "V.G.SERVICE." + std::string(*meant); name != right) {
    cursor.doubt_at(first, name + " does not exist; write " + right + ", in upper case");
  }
}

Variable parse_variable(Cursor& cursor) {
  Variable variable;
  const Token first = cursor.peek();
  const bool system_data = cursor.at_word("SD");
  const bool synchronous = cursor.take().text.size() == 2;  // Vs.E.NAME
  variable.parts.push_back({system_data ? "SD" : "V", {}});
  while (cursor.peek().is(".") && variable.parts.size() < most_parts) {
    cursor.take();
    const Token part = cursor.take_name_part();
    if (part.text.empty()) {
      cursor.fail("a name expected behind the dot");
      break;
    }
    variable.parts.push_back({std::string(part.text), {}});
    variable.parts.back().elements = parse_elements(cursor);
  }
  if (system_data && variable.parts.size() < 2) {
    cursor.fail("system data are written SD.NAME");
  } else if (!system_data && variable.parts.size() < 3) {
    cursor.fail(
        "a variable is written V.G.NAME, V.P.NAME, V.L.NAME, V.S.NAME, V.CYC.NAME, "
        "V.E.NAME or V.A.NAME");
  }
  note_external(cursor, variable, synchronous);
  check_service_member(cursor, first, variable);
  return variable;
}

CycleParameter parse_cycle_parameter(Cursor& cursor) {
  cursor.expect("@");
  if (!cursor.at_word("P")) {
    cursor.fail("a parameter of a cycle is written @P1");
    return {std::make_unique<Expression>()};
  }
  Parameter parameter = parse_parameter(cursor);
  return {std::move(parameter.index)};
}

bool names_variable(const Token& token) {
  return token.kind == TokenKind::name &&
         (same_word(token.text, "V") || same_word(token.text, "VS") || same_word(token.text, "SD"));
}

}  // namespace

bool begins_reference(const Token& token) {
  return token.is("@") ||
         (token.kind == TokenKind::name && (is_run_of_p(token.text) || names_variable(token)));
}

bool at_reference(const Cursor& cursor) {
  return begins_reference(cursor.peek());
}

Reference parse_reference(Cursor& cursor) {
  if (!cursor.enter()) {
    return Parameter{0, std::make_unique<Expression>(), {}};
  }
  Reference reference = cursor.peek().is("@")           ? Reference(parse_cycle_parameter(cursor))
                        : names_variable(cursor.peek()) ? Reference(parse_variable(cursor))
                                                        : Reference(parse_parameter(cursor));
  cursor.leave();
  return reference;
}

}  // namespace millrace::cnc::nc::syntax
