#include "services/archiver/filter.hpp"

#include <charconv>
#include <iomanip>
#include <map>
#include <sstream>

namespace millrace::services::archiver {

namespace {

using fabric::Time;

std::optional<std::chrono::seconds> duration(std::string_view text) {
  static const std::map<char, std::chrono::seconds> units{{'s', std::chrono::seconds(1)},
                                                          {'m', std::chrono::minutes(1)},
                                                          {'h', std::chrono::hours(1)},
                                                          {'d', std::chrono::hours(24)}};
  const auto unit = text.empty() ? units.end() : units.find(text.back());
  if (unit == units.end()) {
    return std::nullopt;
  }
  std::uint32_t count = 0;
  const char* const last = text.data() + text.size() - 1;
  const auto [end, error] = std::from_chars(text.data(), last, count);
  if (error != std::errc() || end != last) {
    return std::nullopt;
  }
  return unit->second * count;
}

std::optional<Time> point(const std::string& text, const char* form) {
  std::istringstream in(text);
  std::tm parts{};
  in >> std::get_time(&parts, form);
  if (in.fail() || in.peek() != std::istringstream::traits_type::eof()) {
    return std::nullopt;
  }
  return Time(std::chrono::seconds(::timegm(&parts)));
}

}  // namespace

tl::expected<Time, std::string> parse_time(std::string_view text, Time now) {
  if (const auto before = duration(text)) {
    return now - *before;
  }
  const std::string without_zone(text.substr(0, text.size() - (text.ends_with('Z') ? 1 : 0)));
  for (const char* const form : {"%Y-%m-%d", "%Y-%m-%dT%H:%M", "%Y-%m-%dT%H:%M:%S"}) {
    if (const auto found = point(without_zone, form)) {
      return *found;
    }
  }
  return tl::unexpected(
      "expected a UTC time like 2026-03-01 or 2026-03-01T07:00, or 15m, 12h, 7d; got '" +
      std::string(text) + "'");
}

}  // namespace millrace::services::archiver
