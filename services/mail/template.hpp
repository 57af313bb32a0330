// Text with places for values. Pure.
//
//   Template::parse("{parts} parts of {program}")->fill({{"parts", "12"}, {"program", "WELLE7"}})
//   → "12 parts of WELLE7"
#pragma once

#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

namespace millrace::services::mail {

using Values = std::map<std::string, std::string, std::less<>>;

class Template {
 public:
  /// {key} is a place, {{ and }} are the braces themselves. A key is 1 to 32 letters, digits, '_'
  /// and '-', or "call." and one. The error names the place.
  static tl::expected<Template, std::string> parse(std::string_view text);

  /// The error is a key that has a place but no value.
  [[nodiscard]] tl::expected<std::string, std::string> fill(const Values& values) const;

  [[nodiscard]] const std::set<std::string>& keys() const { return keys_; }

 private:
  struct Piece {
    std::string text;
    bool is_key = false;
  };

  std::vector<Piece> pieces_;
  std::set<std::string> keys_;
};

/// What the names of values begin with that the call itself brings; no request can give these.
inline constexpr std::string_view call_prefix = "call.";

}  // namespace millrace::services::mail
