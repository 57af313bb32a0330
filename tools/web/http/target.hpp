// Parses the target of a request. Pure; its input is untrusted.
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
  /// Decoded names: never empty, ".", "..", or with '/' or NUL.
  std::vector<std::string> path{};
  /// Decoded; all values of each name, in their order.
  std::map<std::string, std::vector<std::string>> query{};

  /// The value, or an empty text. If a name occurs twice, the last value counts.
  [[nodiscard]] std::string value(const std::string& name) const;
  /// All values of the name.
  [[nodiscard]] std::vector<std::string> values(const std::string& name) const;
};

/// Nothing if it is not an absolute path, or if its names are ambiguous.
std::optional<Target> parse_target(std::string_view text);

}  // namespace millrace::tools::web::http
