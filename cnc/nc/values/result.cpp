#include "cnc/nc/values/result.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "cnc/nc/characters.hpp"

namespace millrace::cnc::nc::values {

namespace {

constexpr double largest_integer = 9007199254740992.0;  // 2^53, the limit of exact integers
constexpr int shown_digits = 10;

}  // namespace

Result<double> number(const Value& value) {
  if (const auto* real = std::get_if<double>(&value)) {
    return *real;
  }
  return fault(21461, "number expected, but this is the string \"" + std::get<std::string>(value) +
                          "\"; convert it with STR_TO_INT or STR_TO_REAL");
}

Result<std::string> text(const Value& value) {
  if (const auto* string = std::get_if<std::string>(&value)) {
    return *string;
  }
  return fault(21460, "string expected, but this is the number " + display(value) +
                          "; convert it with INT_TO_STR or REAL_TO_STR");
}

Result<long> integer(const Value& value) {
  const auto real = number(value);
  if (!real) {
    return tl::make_unexpected(real.error());
  }
  if (!(std::abs(*real) <= largest_integer)) {
    return fault(21883, "overflow: " + display(*real) + " is not an integer of this controller");
  }
  return std::lround(*real);
}

std::string display(const Value& value) {
  if (const auto* string = std::get_if<std::string>(&value)) {
    return *string;
  }
  std::array<char, 64> buffer{};
  const auto [end, error] =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::get<double>(value),
                    std::chars_format::general, shown_digits);
  return {buffer.data(), error == std::errc{} ? end : buffer.data()};
}

bool is_true(double value) {
  return std::abs(value) >= 0.5;
}

namespace {

struct TypeRule {
  std::string_view name;
  VariableType type;
  double least;
  double greatest;
};

constexpr double largest_real = std::numeric_limits<double>::max();
constexpr std::array<TypeRule, 8> rules = {{
    {"BOOLEAN", VariableType::boolean, -largest_real, largest_real},
    {"SGN08", VariableType::sgn08, -128, 127},
    {"UNS08", VariableType::uns08, 0, 255},
    {"SGN16", VariableType::sgn16, -32768, 32767},
    {"UNS16", VariableType::uns16, 0, 65535},
    {"SGN32", VariableType::sgn32, -2147483648.0, 2147483647},
    {"UNS32", VariableType::uns32, 0, 4294967295.0},
    {"REAL64", VariableType::real64, -largest_real, largest_real},
}};

const TypeRule& rule_of(VariableType type) {
  return *std::find_if(rules.begin(), rules.end(),
                       [type](const TypeRule& rule) { return rule.type == type; });
}

Result<Value> fit_string(const VariableShape& shape, const Value& value) {
  return text(value).and_then([&](const std::string& string) -> Result<Value> {
    if (string.size() > shape.length) {
      return fault(21462, "string for variable too long: " + std::to_string(string.size()) +
                              " characters, and " + type_name(shape) + " holds " +
                              std::to_string(shape.length));
    }
    return string;
  });
}

}  // namespace

std::optional<VariableType> find_type(std::string_view name) {
  for (const TypeRule& rule : rules) {
    if (same_word(rule.name, name)) {
      return rule.type;
    }
  }
  return std::nullopt;
}

std::string type_name(const VariableShape& shape) {
  if (shape.type == VariableType::string) {
    return "STRING[" + std::to_string(shape.length) + ']';
  }
  return std::string(rule_of(shape.type).name);
}

Value initial_value(const VariableShape& shape) {
  return shape.type == VariableType::string ? Value(std::string()) : Value(0.0);
}

Result<Value> fit(const VariableShape& shape, const Value& value) {
  if (shape.type == VariableType::string) {
    return fit_string(shape, value);
  }
  return number(value).and_then([&](double given) -> Result<Value> {
    if (shape.type == VariableType::real64) {
      return given;
    }
    if (shape.type == VariableType::boolean) {
      return is_true(given) ? 1.0 : 0.0;
    }
    const TypeRule& rule = rule_of(shape.type);
    const double rounded = std::round(given);
    // False for NaN.
    const bool fits = rounded >= rule.least && rounded <= rule.greatest;
    if (!fits) {
      return fault(21883, "overflow: " + display(given) + " does not fit the type " +
                              std::string(rule.name));
    }
    return rounded;
  });
}

}  // namespace millrace::cnc::nc::values
