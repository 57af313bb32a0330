#include "services/mail/template.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "services/text/fields.hpp"

namespace millrace::services::mail {

namespace {

bool is_key(std::string_view name) {
  if (name.starts_with(call_prefix)) {
    name.remove_prefix(call_prefix.size());
  }
  return text::is_name(name);
}

}  // namespace

tl::expected<Template, std::string> Template::parse(std::string_view text) {
  Template made;
  std::string plain;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t brace = std::min(text.find_first_of("{}", at), text.size());
    plain += text.substr(at, brace - at);
    at = brace;
    if (at == text.size()) {
      break;
    }
    const std::string_view rest = text.substr(at);
    if (rest.starts_with("{{") || rest.starts_with("}}")) {
      plain += rest.front();
      at += 2;
      continue;
    }
    const std::size_t close = rest.find('}');
    const std::string_view key =
        rest.front() == '}' || close == std::string_view::npos ? "" : rest.substr(1, close - 1);
    if (!is_key(key)) {
      return tl::unexpected(fmt::format("expected {{key}}, {{{{ or }}}} at byte {}", at + 1));
    }
    made.pieces_.push_back({.text = std::move(plain)});
    made.pieces_.push_back({.text = std::string(key), .is_key = true});
    made.keys_.emplace(key);
    plain.clear();
    at += close + 1;
  }
  made.pieces_.push_back({.text = std::move(plain)});
  return made;
}

tl::expected<std::string, std::string> Template::fill(const Values& values) const {
  std::string text;
  for (const Piece& piece : pieces_) {
    if (!piece.is_key) {
      text += piece.text;
      continue;
    }
    const auto value = values.find(piece.text);
    if (value == values.end()) {
      return tl::unexpected(piece.text);
    }
    text += value->second;
  }
  return text;
}

}  // namespace millrace::services::mail
