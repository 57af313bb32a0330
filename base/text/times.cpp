#include "base/text/times.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "base/text/ascii.hpp"

namespace millrace::base::text {

namespace {

using std::chrono::nanoseconds;

constexpr std::array<Unit, 8> time_units{{{"ns", 1},
                                          {"us", 1e3},
                                          {"ms", 1e6},
                                          {"s", 1e9},
                                          {"m", 60e9},
                                          {"min", 60e9},
                                          {"h", 3600e9},
                                          {"d", 86400e9}}};

/// Takes `before` and then `digits` digits from the front of `text`.
std::optional<int> take(std::string_view& text, std::string_view before, std::size_t digits) {
  if (!text.starts_with(before) || text.size() < before.size() + digits) {
    return std::nullopt;
  }
  const std::string_view number = text.substr(before.size(), digits);
  if (!std::ranges::all_of(number, is_digit)) {
    return std::nullopt;
  }
  int value = 0;
  for (const char c : number) {
    value = value * 10 + (c - '0');
  }
  text.remove_prefix(before.size() + digits);
  return value;
}

/// ".123" as nanoseconds; zero without a fraction.
nanoseconds take_fraction(std::string_view& text) {
  nanoseconds value{};
  if (text.size() > 1 && text.front() == '.' && is_digit(text[1])) {
    text.remove_prefix(1);
    for (std::int64_t unit = 100'000'000; unit > 0 && !text.empty() && is_digit(text.front());
         unit /= 10) {
      value += nanoseconds((text.front() - '0') * unit);
      text.remove_prefix(1);
    }
  }
  return value;
}

std::optional<Time> point(std::string_view text) {
  using namespace std::chrono;
  const auto y = take(text, "", 4);
  const auto mon = take(text, "-", 2);
  const auto d = take(text, "-", 2);
  if (!y || !mon || !d) {
    return std::nullopt;
  }
  const year_month_day date(year(*y), month(static_cast<unsigned>(*mon)),
                            day(static_cast<unsigned>(*d)));
  nanoseconds of_day{};
  if (const auto h = take(text, "T", 2)) {
    const auto min = take(text, ":", 2);
    const auto s = min ? take(text, ":", 2) : std::nullopt;
    // A leap second becomes the first second of the next minute.
    if (!min || *h > 23 || *min > 59 || s.value_or(0) > 60) {
      return std::nullopt;
    }
    of_day = hours(*h) + minutes(*min) + seconds(s.value_or(0));
    of_day += s ? take_fraction(text) : nanoseconds{};
  }
  if (!date.ok() || (!text.empty() && text != "Z")) {
    return std::nullopt;
  }
  return sys_days(date) + of_day;
}

}  // namespace

std::optional<double> parse_scaled(std::string_view text, std::span<const Unit> units,
                                   double default_factor) {
  double number = 0;
  const char* const last = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), last, number);
  if (error != std::errc{} || !std::isfinite(number) || number < 0) {
    return std::nullopt;
  }
  std::string_view unit(end, static_cast<std::size_t>(last - end));
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  const auto known = std::ranges::find(units, unit, &Unit::name);
  if (known == units.end() && !unit.empty()) {
    return std::nullopt;
  }
  return number * (unit.empty() ? default_factor : known->factor);
}

tl::expected<nanoseconds, std::string> parse_time_span(std::string_view text) {
  // In ns, about a century; more does not fit.
  constexpr double longest = 3e18;
  const auto value = parse_scaled(text, time_units, 1e9);
  if (!value || *value > longest) {
    return tl::unexpected(fmt::format(
        "'{}' is not a duration; expected a number with ns, us, ms, s, m or min, h or d", text));
  }
  return nanoseconds(std::llround(*value));
}

tl::expected<Time, std::string> parse_time(std::string_view text, Time now) {
  if (const auto found = point(text)) {
    return *found;
  }
  const bool has_unit = !text.empty() && !is_digit(text.back()) && text.back() != '.';
  const auto before = parse_time_span(text);
  if (!has_unit || !before) {
    return tl::unexpected(
        fmt::format("'{}' is not a time; expected UTC as in 2026-03-01 or 2026-03-01T07:00:00Z, or "
                    "a time before now as in 15m, 12h, 7d",
                    text));
  }
  return now - *before;
}

}  // namespace millrace::base::text
