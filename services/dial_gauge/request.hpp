// The requests of NC programs to gauges.
//
//   parse("READ depth").value() == Request{Verb::read, "depth"}
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::services::dial_gauge {

enum class Verb : std::uint8_t { read, zero, list, status };

struct Request {
  Verb verb = Verb::read;
  /// Empty for `list`.
  std::string gauge;
  /// READ only: the number of millimetres without the unit, as STR_TO_REAL expects it.
  bool bare = false;
  bool operator==(const Request&) const = default;
};

/// READ g, READ g mm, ZERO g, STATUS g or LIST: words separated by blanks, the verb
/// case-insensitive, the name as configured. The error contains what was expected.
tl::expected<Request, std::string> parse(std::string_view text);

/// Letters, digits, '_' and '-', 1 to 32.
bool is_gauge_name(std::string_view name);

}  // namespace millrace::services::dial_gauge
