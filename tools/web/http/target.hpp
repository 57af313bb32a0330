// The target of a request, taken apart. Pure; reads foreign bytes.
//
//   parse_target("/api/calls/5f-17?limit=20")  →  {"api", "calls", "5f-17"}, limit = "20"
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::tools::web::http {

struct Target {
  /// Decoded, each one a name: never empty, ".", "..", or with a '/' or NUL in it.
  std::vector<std::string> path{};
  /// Decoded; of each name what it was given, in this order.
  std::map<std::string, std::vector<std::string>> query{};

  /// The value, or an empty text. Of a name that is there twice the last one counts.
  [[nodiscard]] std::string value(const std::string& name) const;
  /// All of them.
  [[nodiscard]] std::vector<std::string> values(const std::string& name) const;
};

/// Nothing if it is no path from the root, or what it names could not be told apart from something
/// else.
std::optional<Target> parse_target(std::string_view text);

}  // namespace millrace::tools::web::http
