#include "tools/print/units.hpp"

#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace millrace::tools::print {

namespace {

using std::chrono::nanoseconds;

struct Unit {
  std::string_view name;
  double factor;
};

constexpr std::array<Unit, 6> duration_units{
    {{"ns", 1}, {"us", 1e3}, {"ms", 1e6}, {"s", 1e9}, {"min", 60e9}, {"h", 3600e9}}};
constexpr std::array<Unit, 8> size_units{{{"B", 1},
                                          {"KiB", 1024.},
                                          {"MiB", 1024. * 1024},
                                          {"GiB", 1024. * 1024 * 1024},
                                          {"k", 1e3},
                                          {"M", 1e6},
                                          {"G", 1e9},
                                          {"T", 1e12}}};

/// A number followed by a unit, or by nothing for `default_factor`.
template <std::size_t count>
std::optional<double> parse_scaled(std::string_view text, const std::array<Unit, count>& units,
                                   double default_factor) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || !std::isfinite(number) || number < 0) {
    return std::nullopt;
  }
  std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  if (unit.empty()) {
    return number * default_factor;
  }
  for (const Unit& known : units) {
    if (unit == known.name) {
      return number * known.factor;
    }
  }
  return std::nullopt;
}

std::string three_digits(double value) {
  return fmt::format("{:.{}f}", value, value < 10 ? 2 : value < 100 ? 1 : 0);
}

std::string with_fraction(fabric::Time time, const char* format) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(time - seconds);
  const std::tm utc = fmt::gmtime(std::chrono::system_clock::to_time_t(seconds));
  return fmt::format(fmt::runtime(format), utc) + fmt::format(".{:06}", micros.count());
}

/// Takes `digits` digits and the character after them from the front of `text`.
std::optional<int> take_number(std::string_view& text, std::size_t digits, char after) {
  int value = 0;
  const char* const end = text.data() + std::min(digits, text.size());
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc{} || stop != text.data() + digits) {
    return std::nullopt;
  }
  text.remove_prefix(digits);
  if (after != '\0') {
    if (!text.starts_with(after)) {
      return std::nullopt;
    }
    text.remove_prefix(1);
  }
  return value;
}

/// ".123" as nanoseconds; nothing is zero.
std::optional<nanoseconds> take_fraction(std::string_view& text) {
  if (!text.starts_with('.')) {
    return nanoseconds{};
  }
  text.remove_prefix(1);
  std::int64_t value = 0;
  std::int64_t unit = 1'000'000'000;
  while (!text.empty() && std::isdigit(static_cast<unsigned char>(text.front())) != 0 && unit > 1) {
    unit /= 10;
    value += (text.front() - '0') * unit;
    text.remove_prefix(1);
  }
  return nanoseconds(value);
}

}  // namespace

std::string time_text(fabric::Time time) {
  return time == fabric::Time{} ? "-" : with_fraction(time, "{:%Y-%m-%dT%H:%M:%S}") + 'Z';
}

std::string clock_text(fabric::Time time) {
  return time == fabric::Time{} ? "-" : with_fraction(time, "{:%H:%M:%S}");
}

std::string duration_text(nanoseconds duration) {
  const auto value = static_cast<double>(duration.count());
  const std::string sign = value < 0 ? "-" : "";
  const double size = std::abs(value);
  if (size < 1e3) {
    return fmt::format("{}{} ns", sign, std::llround(size));
  }
  if (size < 1e6) {
    return fmt::format("{}{} us", sign, three_digits(size / 1e3));
  }
  if (size < 1e9) {
    return fmt::format("{}{} ms", sign, three_digits(size / 1e6));
  }
  if (size < 120e9) {
    return fmt::format("{}{} s", sign, three_digits(size / 1e9));
  }
  const auto minutes = std::llround(size / 60e9);
  return minutes < 120 ? fmt::format("{}{} min", sign, minutes)
                       : fmt::format("{}{} h {} min", sign, minutes / 60, minutes % 60);
}

std::string size_text(std::uint64_t bytes) {
  const auto size = static_cast<double>(bytes);
  if (size < 1024) {
    return fmt::format("{} B", bytes);
  }
  if (size < 1024. * 1024) {
    return fmt::format("{:.1f} KiB", size / 1024);
  }
  if (size < 1024. * 1024 * 1024) {
    return fmt::format("{:.1f} MiB", size / (1024. * 1024));
  }
  return fmt::format("{:.2f} GiB", size / (1024. * 1024 * 1024));
}

tl::expected<fabric::Time, std::string> parse_time(std::string_view text) {
  using namespace std::chrono;
  std::string_view rest = text;
  const auto y = take_number(rest, 4, '-');
  const auto mon = take_number(rest, 2, '-');
  const auto d = take_number(rest, 2, 'T');
  const auto h = take_number(rest, 2, ':');
  const auto min = take_number(rest, 2, ':');
  const auto s = take_number(rest, 2, '\0');
  const auto fraction = take_fraction(rest);
  const bool ended = rest == "Z";
  if (y && mon && d && h && min && s && fraction && ended) {
    const year_month_day date(year(*y), month(static_cast<unsigned>(*mon)),
                              day(static_cast<unsigned>(*d)));
    if (date.ok() && *h < 24 && *min < 60 && *s < 61) {
      return sys_days(date) + hours(*h) + minutes(*min) + seconds(*s) + *fraction;
    }
  }
  return tl::unexpected(
      fmt::format("'{}' is no time; expected UTC as in 2026-03-01T07:00:00Z", text));
}

tl::expected<nanoseconds, std::string> parse_duration(std::string_view text) {
  // Longer than a century does not fit.
  constexpr double longest = 3e18;
  const auto value = parse_scaled(text, duration_units, 1e9);
  if (!value || *value > longest) {
    return tl::unexpected(
        fmt::format("'{}' is no duration; expected a number with ns, us, ms, s, min or h", text));
  }
  return nanoseconds(std::llround(*value));
}

tl::expected<std::uint64_t, std::string> parse_size(std::string_view text) {
  constexpr double largest = 1e18;
  const auto value = parse_scaled(text, size_units, 1);
  if (!value || *value > largest) {
    return tl::unexpected(
        fmt::format("'{}' is no size; expected a number with B, KiB, MiB, GiB, k, M or G", text));
  }
  return static_cast<std::uint64_t>(*value);
}

}  // namespace millrace::tools::print
