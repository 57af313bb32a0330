#include "services/square_root/root.hpp"

#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <tl/expected.hpp>

#include "base/text/ascii.hpp"
#include "fabric/messages.hpp"
#include "services/text/answer.hpp"

namespace millrace::services::square_root {

namespace {

tl::expected<double, std::string> parse(std::string_view request) {
  if (request.empty()) {
    return tl::unexpected(std::string("the request is empty, expected a number"));
  }
  // from_chars accepts no plus sign.
  std::string_view digits = request;
  if (digits.front() == '+' && digits.substr(1, 1) != "-") {
    digits.remove_prefix(1);
  }
  double number = 0;
  const auto [end, error] = std::from_chars(digits.begin(), digits.end(), number);
  if (error == std::errc::result_out_of_range) {
    return tl::unexpected(
        fmt::format("{} is out of the range of a number", text::in_quotes(request)));
  }
  if (error != std::errc() || end != digits.end() || !std::isfinite(number)) {
    return tl::unexpected(fmt::format("{} is not a number", text::in_quotes(request)));
  }
  return number;
}

/// `prefix` and the number, in the format that fits.
std::string with_number(std::string_view prefix, double number) {
  std::string text = fmt::format("{}{:f}", prefix, number);
  return text.size() <= fabric::max_text ? text : fmt::format("{}{:e}", prefix, number);
}

}  // namespace

sdk::Response square_root(std::string_view request) {
  const auto number = parse(base::text::trim(request));
  if (!number) {
    return text::error(state_error, number.error());
  }
  if (*number < 0) {
    return {
        .text = with_number("ERROR: cannot calc square root of negative number ", *number),
        .state = state_error,
    };
  }
  // The root of -0 is -0, which would confuse a reader.
  return {.text = with_number("", std::abs(std::sqrt(*number))), .state = state_ok};
}

}  // namespace millrace::services::square_root
