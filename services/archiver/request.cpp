#include "services/archiver/request.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "services/text/answer.hpp"
#include "services/text/words.hpp"

namespace millrace::services::archiver {

namespace {

constexpr std::size_t max_key = 32;

/// Reads "key=value key=value" from left to right.
class Pairs {
 public:
  explicit Pairs(std::string_view text) : rest_(text) {}

  /// The next pair; call it while more() is true.
  tl::expected<Field, std::string> next() {
    const std::size_t equals = rest_.find('=');
    const std::string_view key = rest_.substr(0, equals);
    if (equals == std::string_view::npos || !is_key(key)) {
      return tl::unexpected("expected key=value at " + text::in_quotes(rest_));
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
  static bool is_key(std::string_view key) {
    return !key.empty() && key.size() <= max_key &&
           std::all_of(key.begin(), key.end(), text::is_name_character);
  }

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
        return tl::unexpected("no closing quote for " + text::in_quotes(start));
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
      return tl::unexpected("expected a blank at " + text::in_quotes(rest_));
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

tl::expected<std::vector<Field>, std::string> parse(std::string_view request) {
  const auto words = text::words(request);
  if (words.empty()) {
    return tl::unexpected(std::string("the request is empty; expected PUT key=value ... or text"));
  }
  if (text::upper_case(words[0]) != "PUT") {
    return std::vector<Field>{};
  }
  const auto behind_verb = static_cast<std::size_t>(words[0].end() - request.begin());
  Pairs pairs(request.substr(behind_verb));
  std::vector<Field> fields;
  while (pairs.more()) {
    auto field = pairs.next();
    if (!field) {
      return tl::unexpected(field.error());
    }
    if (has(fields, field->key)) {
      return tl::unexpected("key " + text::in_quotes(field->key) + " is there twice");
    }
    fields.push_back(std::move(*field));
  }
  if (fields.empty()) {
    return tl::unexpected(std::string("PUT without key=value"));
  }
  return fields;
}

}  // namespace millrace::services::archiver
