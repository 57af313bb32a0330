#include <array>
#include <utility>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/syntax/parsers.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

using values::BinaryOperator;

struct BinaryRule {
  std::string_view spelling;
  BinaryOperator operation;
  int precedence;
};

constexpr std::array<BinaryRule, 20> binary_rules = {{
    {"||", BinaryOperator::logical_or, 1},   {"OR", BinaryOperator::logical_or, 1},
    {"XOR", BinaryOperator::logical_xor, 2}, {"&&", BinaryOperator::logical_and, 3},
    {"AND", BinaryOperator::logical_and, 3}, {"|", BinaryOperator::bit_or, 4},
    {"^", BinaryOperator::bit_xor, 5},       {"&", BinaryOperator::bit_and, 6},
    {"==", BinaryOperator::equal, 7},        {"!=", BinaryOperator::not_equal, 7},
    {"<", BinaryOperator::less, 7},          {"<=", BinaryOperator::less_or_equal, 7},
    {">", BinaryOperator::greater, 7},       {">=", BinaryOperator::greater_or_equal, 7},
    {"+", BinaryOperator::add, 8},           {"-", BinaryOperator::subtract, 8},
    {"*", BinaryOperator::multiply, 9},      {"/", BinaryOperator::divide, 9},
    {"MOD", BinaryOperator::modulo, 9},      {"**", BinaryOperator::power, 11},
}};
constexpr int lowest_precedence = 1;
constexpr int unary_precedence = 10;
// A chain a+a+a… nests to the left; its evaluation and its deletion recurse as deep.
constexpr int longest_chain = 500;

struct NamedNumber {
  std::string_view name;
  double value;
};
constexpr std::array<NamedNumber, 3> constants = {
    {{"TRUE", 1.0}, {"FALSE", 0.0}, {"PI", 3.14159265358979323846}}};

struct NamedQuery {
  std::string_view name;
  QueryKind kind;
};
constexpr std::array<NamedQuery, 4> queries = {{{"EXIST", QueryKind::exists},
                                                {"SIZEOF", QueryKind::size_of},
                                                {"IS_STRING", QueryKind::is_string},
                                                {"IS_NUMBER", QueryKind::is_number}}};

template <class Table>
auto find_named(const Table& table, const Token& token) -> const typename Table::value_type* {
  if (token.kind == TokenKind::name) {
    for (const auto& entry : table) {
      if (same_word(entry.name, token.text)) {
        return &entry;
      }
    }
  }
  return nullptr;
}

const BinaryRule* find_binary(const Token& token) {
  if (token.kind == TokenKind::symbol || token.kind == TokenKind::name) {
    for (const BinaryRule& rule : binary_rules) {
      if (same_word(rule.spelling, token.text)) {
        return &rule;
      }
    }
  }
  return nullptr;
}

ExpressionPointer on_heap(Expression expression) {
  return std::make_unique<Expression>(std::move(expression));
}

Expression parse_binary(Cursor& cursor, int precedence);

// SIN[…], MAX[a, b]
Expression parse_call(Cursor& cursor, const values::Function& function) {
  const Token name = cursor.take();
  Call call{&function, {}};
  cursor.expect("[");
  do {
    call.arguments.push_back(parse_expression(cursor));
  } while (cursor.accept(",") && !cursor.failed());
  cursor.expect("]");
  if (call.arguments.size() < function.least_arguments ||
      call.arguments.size() > function.most_arguments) {
    cursor.fail_at(name, std::string(function.name) + " takes " +
                             std::to_string(function.most_arguments) + " arguments, not " +
                             std::to_string(call.arguments.size()));
    return {};
  }
  return {std::move(call)};
}

// EXIST[V.P.A], EXIST[M80]
Expression parse_query(Cursor& cursor, QueryKind kind) {
  cursor.take();
  cursor.expect("[");
  if (kind == QueryKind::exists && at_machine_function(cursor)) {
    cursor.take_letter();
    Query query{QueryKind::has_function, nullptr, on_heap(parse_word_value(cursor))};
    cursor.expect("]");
    return {std::move(query)};
  }
  if (!at_reference(cursor)) {
    cursor.fail("a parameter or variable expected before " + describe(cursor.peek()));
    return {};
  }
  Query query{kind, std::make_unique<Reference>(parse_reference(cursor)), nullptr};
  if (kind == QueryKind::size_of && cursor.accept(",")) {
    query.argument = on_heap(parse_expression(cursor));
  }
  cursor.expect("]");
  return {std::move(query)};
}

Expression parse_name(Cursor& cursor) {
  if (at_reference(cursor)) {
    return std::visit(
        [](auto&& reference) { return Expression{std::forward<decltype(reference)>(reference)}; },
        parse_reference(cursor));
  }
  const Token& token = cursor.peek();
  if (const auto* query = find_named(queries, token)) {
    return parse_query(cursor, query->kind);
  }
  if (const auto* constant = find_named(constants, token)) {
    cursor.take();
    return {Number{constant->value}};
  }
  if (const values::Function* function = values::find_function(token.text)) {
    return parse_call(cursor, *function);
  }
  cursor.fail_unknown_at(token, "unknown name " + describe(token) + " in an expression");
  return {};
}

Expression parse_primary(Cursor& cursor) {
  const Token& token = cursor.peek();
  switch (token.kind) {
    case TokenKind::number:
      return {Number{cursor.take().number}};
    case TokenKind::string:
      return {Text{unquote(cursor.take().text)}};
    case TokenKind::name:
      return parse_name(cursor);
    default:
      break;
  }
  if (token.is("@")) {
    return parse_name(cursor);
  }
  if (cursor.accept("[")) {
    Expression inner = parse_binary(cursor, lowest_precedence);
    cursor.expect("]");
    return inner;
  }
  cursor.fail("a value expected before " + describe(token));
  return {};
}

Expression negated(Expression operand) {
  if (auto* number = std::get_if<Number>(&operand.node)) {
    return {Number{-number->value}};
  }
  return {Unary{UnaryOperator::minus, on_heap(std::move(operand))}};
}

Expression parse_unary(Cursor& cursor) {
  if (cursor.accept("-")) {
    return negated(parse_binary(cursor, unary_precedence));
  }
  if (cursor.accept("!")) {
    return {Unary{UnaryOperator::logical_not, on_heap(parse_binary(cursor, unary_precedence))}};
  }
  if (cursor.accept("+")) {
    return parse_binary(cursor, unary_precedence);
  }
  return parse_primary(cursor);
}

// Operators of at least this precedence, by precedence climbing; all are left-associative.
Expression parse_binary(Cursor& cursor, int precedence) {
  if (!cursor.enter()) {
    return {};
  }
  Expression left = parse_unary(cursor);
  int chain = 0;
  for (const BinaryRule* rule = find_binary(cursor.peek());
       rule != nullptr && rule->precedence >= precedence; rule = find_binary(cursor.peek())) {
    if (++chain > longest_chain) {
      cursor.fail("the expression has more than " + std::to_string(longest_chain) + " operators");
      break;
    }
    cursor.take();
    Expression right = parse_binary(cursor, rule->precedence + 1);
    left = {Binary{rule->operation, on_heap(std::move(left)), on_heap(std::move(right))}};
  }
  cursor.leave();
  return left;
}

}  // namespace

bool begins_value(const Token& token) {
  return token.kind != TokenKind::name || begins_reference(token) ||
         find_named(queries, token) != nullptr || find_named(constants, token) != nullptr ||
         values::find_function(token.text) != nullptr;
}

bool at_machine_function(const Cursor& cursor) {
  const std::string_view text = cursor.peek().text;
  if (cursor.peek().kind != TokenKind::name || (upper(text[0]) != 'M' && upper(text[0]) != 'H')) {
    return false;
  }
  const std::string_view number = text.substr(text.size() > 1 && upper(text[1]) == 'P' ? 2 : 1);
  return number.empty() || is_digit(number.front());
}

Expression parse_expression(Cursor& cursor) {
  return parse_binary(cursor, lowest_precedence);
}

Expression parse_word_value(Cursor& cursor) {
  if (!cursor.enter()) {
    return {};
  }
  Expression value;
  if (cursor.accept("-")) {
    value = negated(parse_word_value(cursor));
  } else if (cursor.accept("+")) {
    value = parse_word_value(cursor);
  } else {
    value = parse_primary(cursor);
  }
  cursor.leave();
  return value;
}

}  // namespace millrace::cnc::nc::syntax
