// Text with placeholders for values. Pure.
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
  /// {key} is a placeholder, {{ and }} are literal braces. A key is 1 to 32 letters, digits, '_'
  /// and '-', optionally after "call.". The error contains the position.
  static tl::expected<Template, std::string> parse(std::string_view text);

  /// The error is a key without a value.
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

/// Prefix of the keys whose values come from the call; a request cannot set them.
inline constexpr std::string_view call_prefix = "call.";

}  // namespace millrace::services::mail
