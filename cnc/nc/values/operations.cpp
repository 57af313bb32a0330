#include "cnc/nc/values/operations.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "cnc/nc/characters.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::values {

namespace {

constexpr std::size_t longest_string = 4096;

double truth(bool value) {
  return value ? 1.0 : 0.0;
}

template <class T>
bool compare(BinaryOperator operation, const T& left, const T& right) {
  switch (operation) {
    case BinaryOperator::equal:
      return left == right;
    case BinaryOperator::not_equal:
      return left != right;
    case BinaryOperator::less:
      return left < right;
    case BinaryOperator::less_or_equal:
      return left <= right;
    case BinaryOperator::greater:
      return left > right;
    default:
      return left >= right;
  }
}

bool is_comparison(BinaryOperator operation) {
  return operation >= BinaryOperator::equal && operation <= BinaryOperator::greater_or_equal;
}

Result<Value> apply_to_strings(BinaryOperator operation, const std::string& left,
                               const std::string& right) {
  if (is_comparison(operation)) {
    return truth(compare(operation, left, right));
  }
  if (operation != BinaryOperator::add) {
    return fault(21461, "number expected; strings can only be joined with + and compared");
  }
  if (left.size() + right.size() > longest_string) {
    return fault(21462, "the joined string is longer than " + std::to_string(longest_string));
  }
  return left + right;
}

Result<Value> apply_bits(BinaryOperator operation, double left, double right) {
  const auto a = integer(left);
  const auto b = integer(right);
  if (!a || !b) {
    return tl::make_unexpected(a ? b.error() : a.error());
  }
  switch (operation) {
    case BinaryOperator::bit_or:
      return static_cast<double>(*a | *b);
    case BinaryOperator::bit_xor:
      return static_cast<double>(*a ^ *b);
    default:
      return static_cast<double>(*a & *b);
  }
}

Result<Value> apply_to_numbers(BinaryOperator operation, double left, double right) {
  switch (operation) {
    case BinaryOperator::logical_or:
      return truth(is_true(left) || is_true(right));
    case BinaryOperator::logical_xor:
      return truth(is_true(left) != is_true(right));
    case BinaryOperator::logical_and:
      return truth(is_true(left) && is_true(right));
    case BinaryOperator::bit_or:
    case BinaryOperator::bit_xor:
    case BinaryOperator::bit_and:
      return apply_bits(operation, left, right);
    case BinaryOperator::add:
      return finite(left + right);
    case BinaryOperator::subtract:
      return finite(left - right);
    case BinaryOperator::multiply:
      return finite(left * right);
    case BinaryOperator::divide:
      return right == 0 ? fault(20396, "division by zero") : finite(left / right);
    case BinaryOperator::modulo:
      return right == 0 ? fault(20574, "division by zero in MOD") : finite(std::fmod(left, right));
    case BinaryOperator::power:
      return finite(std::pow(left, right));
    default:
      return truth(compare(operation, left, right));
  }
}

}  // namespace

Result<Value> apply(BinaryOperator operation, const Value& left, const Value& right) {
  const auto* left_text = std::get_if<std::string>(&left);
  const auto* right_text = std::get_if<std::string>(&right);
  if (left_text != nullptr && right_text != nullptr) {
    return apply_to_strings(operation, *left_text, *right_text);
  }
  if (left_text != nullptr) {
    // The left side determines the type; the right one has the wrong type.
    return tl::make_unexpected(text(right).error());
  }
  if (right_text != nullptr) {
    return tl::make_unexpected(number(right).error());
  }
  return apply_to_numbers(operation, std::get<double>(left), std::get<double>(right));
}

bool is_string_function(const Function& function) {
  const auto table = string_functions();
  return &function >= table.data() && &function < table.data() + table.size();
}

const Function* find_function(std::string_view name) {
  for (const auto table : {number_functions(), string_functions()}) {
    const auto found = std::find_if(table.begin(), table.end(), [&](const Function& function) {
      return same_word(function.name, name);
    });
    if (found != table.end()) {
      return &*found;
    }
  }
  return nullptr;
}

}  // namespace millrace::cnc::nc::values
