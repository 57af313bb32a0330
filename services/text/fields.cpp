#include "services/text/fields.hpp"

#include <algorithm>

#include "services/text/answer.hpp"

namespace millrace::services::text {

namespace {

constexpr std::size_t max_name = 32;

/// Reads "key=value key=value" from left to right.
class Pairs {
 public:
  explicit Pairs(std::string_view text) : rest_(text) {}

  /// The next pair; call it while more() is true.
  tl::expected<Field, std::string> next() {
    const std::size_t equals = rest_.find('=');
    const std::string_view key = rest_.substr(0, equals);
    if (equals == std::string_view::npos || !is_name(key)) {
      return tl::unexpected("expected key=value at " + in_quotes(rest_));
    }
    rest_.remove_prefix(equals + 1);
    auto value = rest_.starts_with('"') ? quoted_value() : plain_value();
    if (!value) {
      return tl::unexpected(value.error());
    }
    return Field{.key = std::string(key), .value = std::move(*value)};
  }

  bool more() {
    rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t"), rest_.size()));
    return !rest_.empty();
  }

 private:
  tl::expected<std::string, std::string> plain_value() {
    const std::size_t end = std::min(rest_.find_first_of(" \t"), rest_.size());
    const std::string value(rest_.substr(0, end));
    rest_.remove_prefix(end);
    return value;
  }

  tl::expected<std::string, std::string> quoted_value() {
    const std::string_view start = rest_;
    std::string value;
    rest_.remove_prefix(1);
    while (true) {
      const std::size_t quote = rest_.find('"');
      if (quote == std::string_view::npos) {
        return tl::unexpected("no closing quote for " + in_quotes(start));
      }
      value += rest_.substr(0, quote);
      rest_.remove_prefix(quote + 1);
      if (!rest_.starts_with('"')) {
        break;
      }
      value += '"';
      rest_.remove_prefix(1);
    }
    if (!rest_.empty() && rest_.find_first_of(" \t") != 0) {
      return tl::unexpected("expected a blank at " + in_quotes(rest_));
    }
    return value;
  }

  std::string_view rest_;
};

bool has(const std::vector<Field>& fields, const std::string& key) {
  return std::any_of(fields.begin(), fields.end(),
                     [&](const Field& field) { return field.key == key; });
}

}  // namespace

tl::expected<std::vector<Field>, std::string> fields(std::string_view text) {
  Pairs pairs(text);
  std::vector<Field> fields;
  while (pairs.more()) {
    auto field = pairs.next();
    if (!field) {
      return tl::unexpected(field.error());
    }
    if (has(fields, field->key)) {
      return tl::unexpected("key " + in_quotes(field->key) + " occurs twice");
    }
    fields.push_back(std::move(*field));
  }
  return fields;
}

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= max_name &&
         std::all_of(name.begin(), name.end(), is_name_character);
}

namespace {

constexpr std::string_view blanks = " \t";

bool is_lower(char c) {
  return c >= 'a' && c <= 'z';
}

}  // namespace

std::vector<std::string_view> words(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t at = text.find_first_not_of(blanks); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = text.find_first_not_of(blanks, end);
  }
  return words;
}

std::string upper_case(std::string_view text) {
  std::string upper(text);
  std::transform(upper.begin(), upper.end(), upper.begin(),
                 [](char c) { return is_lower(c) ? static_cast<char>(c - 'a' + 'A') : c; });
  return upper;
}

bool is_name_character(char c) {
  return is_lower(c) || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

}  // namespace millrace::services::text
