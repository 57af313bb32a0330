#include "cnc/nc/values/conversion.hpp"

#include <array>
#include <charconv>
#include <cmath>

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

}  // namespace millrace::cnc::nc::values
