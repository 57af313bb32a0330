#include "tools/print/units.hpp"

#include <array>
#include <cmath>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "base/text/times.hpp"

namespace millrace::tools::print {

namespace {

using base::text::Unit;
using std::chrono::nanoseconds;

/// As people write them: MB is 1,000,000 bytes, MiB 1,048,576.
constexpr std::array<Unit, 19> size_units{{{"B", 1},
                                           {"k", 1e3},
                                           {"K", 1e3},
                                           {"M", 1e6},
                                           {"G", 1e9},
                                           {"T", 1e12},
                                           {"kB", 1e3},
                                           {"KB", 1e3},
                                           {"MB", 1e6},
                                           {"GB", 1e9},
                                           {"TB", 1e12},
                                           {"Ki", 1024.},
                                           {"Mi", 1024. * 1024},
                                           {"Gi", 1024. * 1024 * 1024},
                                           {"Ti", 1024. * 1024 * 1024 * 1024},
                                           {"KiB", 1024.},
                                           {"MiB", 1024. * 1024},
                                           {"GiB", 1024. * 1024 * 1024},
                                           {"TiB", 1024. * 1024 * 1024 * 1024}}};

std::string three_digits(double value) {
  return fmt::format("{:.{}f}", value, value < 10 ? 2 : value < 100 ? 1 : 0);
}

std::string with_fraction(fabric::Time time, const char* format) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(time);
  const auto micros = std::chrono::duration_cast<std::chrono::microseconds>(time - seconds);
  const std::tm utc = fmt::gmtime(std::chrono::system_clock::to_time_t(seconds));
  return fmt::format(fmt::runtime(format), utc) + fmt::format(".{:06}", micros.count());
}

}  // namespace

std::string time_text(fabric::Time time) {
  return time == fabric::Time{} ? "-" : with_fraction(time, "{:%Y-%m-%dT%H:%M:%S}") + 'Z';
}

std::string clock_text(fabric::Time time) {
  return time == fabric::Time{} ? "-" : with_fraction(time, "{:%H:%M:%S}") + 'Z';
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
  if (size < 60e9) {
    return fmt::format("{}{} s", sign, three_digits(size / 1e9));
  }
  return sign + age_text(std::chrono::abs(duration));
}

std::string age_text(nanoseconds age) {
  const auto seconds = std::chrono::floor<std::chrono::seconds>(age).count();
  const auto minutes = seconds / 60;
  const auto hours = minutes / 60;
  if (hours >= 24) {
    return fmt::format("{}d{:02}h", hours / 24, hours % 24);
  }
  if (minutes >= 60) {
    return fmt::format("{}h{:02}m", hours, minutes % 60);
  }
  return minutes > 0 ? fmt::format("{}m{:02}s", minutes, seconds % 60)
                     : fmt::format("{}s", seconds);
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

tl::expected<std::uint64_t, std::string> parse_size(std::string_view text) {
  constexpr double largest = 1e18;
  const auto value = base::text::parse_scaled(text, size_units, 1);
  if (!value || *value > largest) {
    return tl::unexpected(fmt::format(
        "'{}' is not a size; expected a number with B, kB, MB, GB or KiB, MiB, GiB, as in 64MiB",
        text));
  }
  return static_cast<std::uint64_t>(*value);
}

}  // namespace millrace::tools::print
