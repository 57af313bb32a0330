#include "services/dial_gauge/length.hpp"

#include <cassert>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace millrace::services::dial_gauge {

namespace {

constexpr unsigned max_digits = 12;
constexpr unsigned max_decimals = 6;

Nanometres power_of_ten(unsigned exponent) {
  Nanometres power = 1;
  for (; exponent > 0; --exponent) {
    power *= 10;
  }
  return power;
}

/// `value` / `divisor`, rounded half away from zero.
Nanometres divided(Nanometres value, Nanometres divisor) {
  const Nanometres half = divisor / 2;
  return (value < 0 ? value - half : value + half) / divisor;
}

}  // namespace

std::optional<Nanometres> parse_length(std::string_view text, Unit unit) {
  if (text.empty() || (text[0] != '+' && text[0] != '-')) {
    return std::nullopt;
  }
  const bool negative = text[0] == '-';
  text.remove_prefix(1);
  const std::size_t point = text.find('.');
  std::string digits(text.substr(0, point));
  unsigned decimals = 0;
  if (point != std::string_view::npos) {
    const std::string_view fraction = text.substr(point + 1);
    decimals = static_cast<unsigned>(std::min<std::size_t>(fraction.size(), max_decimals + 1));
    digits += fraction;
  }
  if (digits.empty() || digits.size() > max_digits || decimals > max_decimals ||
      digits.find_first_not_of("0123456789") != std::string::npos) {
    return std::nullopt;
  }
  // 12 digits times 25.4 million overflows 64 bits; a gauge shows far fewer, but a line may carry
  // any bytes.
  Nanometres number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const Nanometres scale = unit == Unit::mm ? nanometres_per_mm : nanometres_per_inch;
  Nanometres product = 0;
  if (__builtin_mul_overflow(number, scale, &product)) {
    return std::nullopt;
  }
  const Nanometres length = divided(product, power_of_ten(decimals));
  return negative ? -length : length;
}

std::string to_text(Nanometres length, unsigned decimals) {
  assert(decimals <= max_decimals);
  const Nanometres steps = divided(length, power_of_ten(max_decimals - decimals));
  const Nanometres per_mm = power_of_ten(decimals);
  const Nanometres size = steps < 0 ? -steps : steps;
  const char* const sign = steps < 0 ? "-" : "";
  return decimals == 0
             ? fmt::format("{}{} mm", sign, size)
             : fmt::format("{}{}.{:0{}} mm", sign, size / per_mm, size % per_mm, decimals);
}

Nanometres quantised(double nanometres, Nanometres step) {
  assert(step > 0);
  return std::llround(nanometres / static_cast<double>(step)) * step;
}

}  // namespace millrace::services::dial_gauge
