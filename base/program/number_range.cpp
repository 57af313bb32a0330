#include "base/program/number_range.hpp"

#include <charconv>
#include <cmath>
#include <string>

#include <fmt/format.h>

namespace millrace::base::program {
namespace {

/// False for a text that is not a finite number.
bool is_number(const std::string& text, double& number) {
  const char* const end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, number);
  return error == std::errc() && at == end && std::isfinite(number);
}

CLI::Validator checked(std::string name, std::string expected, bool (*fits)(double)) {
  return {[expected = std::move(expected), fits](const std::string& text) {
            double number = 0;
            return is_number(text, number) && fits(number)
                       ? std::string()
                       : fmt::format("{} is not allowed; expected {}", text, expected);
          },
          std::move(name)};
}

}  // namespace

CLI::Validator positive_number() {
  return checked("POSITIVE", "a number greater than 0", [](double number) { return number > 0; });
}

CLI::Validator non_negative_number() {
  return checked("NONNEGATIVE", "0 or a greater number", [](double number) { return number >= 0; });
}

}  // namespace millrace::base::program
