#include "cnc/nc/syntax/lexer.hpp"

#include <array>
#include <charconv>

#include "cnc/nc/characters.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

constexpr std::array<std::string_view, 11> two_character_symbols = {
    "**", "==", "!=", "<=", ">=", "&&", "||", "+=", "-=", "*=", "/="};
constexpr std::string_view one_character_symbols = "[]=+-*/<>!&|^,:#$%@.";
constexpr std::size_t comment_end_limit = 128;

// `#COMMENT END`, optionally after a block number.
bool ends_comment(std::string_view line) {
  Lexer lexer(line);
  Token token = lexer.next();
  if (token.kind == TokenKind::name) {
    token = lexer.next();
  }
  return token.is("#") && same_word(lexer.next().text, "COMMENT") &&
         same_word(lexer.next().text, "END");
}

// Number of consecutive backslashes. They have a meaning only before a quotation mark: an odd one
// escapes it, two are one backslash.
std::size_t backslashes_at(std::string_view text, std::size_t at) {
  const std::size_t end = text.find_first_not_of('\\', at);
  return (end == std::string_view::npos ? text.size() : end) - at;
}

}  // namespace

std::string unquote(std::string_view quoted) {
  std::string out;
  for (std::size_t i = 1; i + 1 < quoted.size(); ++i) {
    const std::size_t backslashes = backslashes_at(quoted, i);
    i += backslashes;
    const bool before_mark = quoted[i] == '"';
    out.append(before_mark ? backslashes / 2 : backslashes, '\\');
    if (before_mark && backslashes % 2 == 0) {
      break;  // the mark that ends the text
    }
    out += quoted[i];
  }
  return out;
}

void Lexer::skip_to_line_end() {
  while (position_ < text_.size() && !is_line_end(text_[position_])) {
    ++position_;
  }
}

// Comments nest; an unclosed one ends with its line.
void Lexer::skip_bracketed_comment() {
  int depth = 0;
  for (; position_ < text_.size() && !is_line_end(text_[position_]); ++position_) {
    if (text_[position_] == '(') {
      ++depth;
    } else if (text_[position_] == ')' && --depth == 0) {
      ++position_;
      return;
    }
  }
}

std::size_t Lexer::line_end_length(std::size_t position) const {
  return at(position) == '\r' && at(position + 1) == '\n' ? 2 : 1;
}

// The beginning of the next line if a \ here continues this one, otherwise 0.
std::size_t Lexer::continued_line() const {
  std::size_t position = position_ + 1;
  while (position < text_.size() && is_blank(text_[position])) {
    ++position;
  }
  return position < text_.size() && is_line_end(text_[position])
             ? position + line_end_length(position)
             : 0;
}

void Lexer::new_line(std::size_t next_line) {
  position_ = next_line;
  line_begin_ = next_line;
  ++line_;
}

void Lexer::skip_separators() {
  while (position_ < text_.size()) {
    const char c = text_[position_];
    if (is_blank(c)) {
      ++position_;
    } else if (c == '(') {
      skip_bracketed_comment();
    } else if (c == ';') {
      skip_to_line_end();
    } else if (const std::size_t next_line = c == '\\' ? continued_line() : 0; next_line != 0) {
      new_line(next_line);
    } else {
      return;
    }
  }
}

Token Lexer::make(TokenKind kind, std::size_t end) const {
  Token token;
  token.kind = kind;
  token.text = text_.substr(position_, end - position_);
  token.begin = position_;
  token.end = end;
  token.line = line_;
  token.column = static_cast<int>(position_ - line_begin_) + 1;
  token.adjacent = position_ == last_end_;
  return token;
}

Token Lexer::finish(Token token) {
  position_ = token.end;
  last_end_ = token.end;
  if (token.kind == TokenKind::end_of_block) {
    new_line(token.end);
  }
  return token;
}

Token Lexer::number_token() const {
  std::size_t end = position_;
  const auto skip_digits = [&] {
    while (is_digit(at(end))) {
      ++end;
    }
  };
  skip_digits();
  if (at(end) == '.') {
    ++end;
    skip_digits();
  }
  if (at(end) == 'E' || at(end) == 'e') {
    const std::size_t sign = at(end + 1) == '+' || at(end + 1) == '-' ? 1U : 0U;
    if (is_digit(at(end + 1 + sign))) {
      end += 1 + sign;
      skip_digits();
    }
  }
  Token token = make(TokenKind::number, end);
  const auto [stop, error] =
      std::from_chars(token.text.data(), token.text.data() + token.text.size(), token.number);
  if (error != std::errc{}) {
    token.kind = TokenKind::invalid;
    token.text = "this number does not fit a REAL64";
  }
  return token;
}

// A run of P before a digit is a token of its own: P12, PP1, XP3 (after the letter X).
Token Lexer::name_token() const {
  std::size_t end = position_;
  while (upper(at(end)) == 'P') {
    ++end;
  }
  if (end > position_ && is_digit(at(end))) {
    return make(TokenKind::name, end);
  }
  while (is_letter(at(end)) || is_digit(at(end))) {
    ++end;
  }
  return make(TokenKind::name, end);
}

Token Lexer::string_token() const {
  for (std::size_t end = position_ + 1; end < text_.size() && !is_line_end(text_[end]); ++end) {
    const std::size_t backslashes = backslashes_at(text_, end);
    if (backslashes > 0) {
      // An unescaped mark is handled in the next step.
      const bool escapes = backslashes % 2 == 1 && at(end + backslashes) == '"';
      end += escapes ? backslashes : backslashes - 1;
    } else if (text_[end] == '"') {
      return make(TokenKind::string, end + 1);
    }
  }
  Token token = make(TokenKind::invalid, position_ + 1);
  token.text = "this text has no closing quotation mark in its line";
  return token;
}

Token Lexer::symbol_token() const {
  const std::string_view rest = text_.substr(position_);
  for (const std::string_view symbol : two_character_symbols) {
    if (rest.starts_with(symbol)) {
      return make(TokenKind::symbol, position_ + 2);
    }
  }
  if (one_character_symbols.find(rest.front()) != std::string_view::npos) {
    return make(TokenKind::symbol, position_ + 1);
  }
  Token token = make(TokenKind::invalid, position_ + 1);
  token.text = rest.front() == '\\' ? "a \\ continues a block only at the end of a line"
                                    : "this character has no meaning here";
  return token;
}

Token Lexer::next() {
  skip_separators();
  if (position_ >= text_.size()) {
    return finish(make(TokenKind::end_of_program, position_));
  }
  const char c = text_[position_];
  if (is_line_end(c)) {
    return finish(make(TokenKind::end_of_block, position_ + line_end_length(position_)));
  }
  if (is_digit(c) || (c == '.' && is_digit(at(position_ + 1)))) {
    return finish(number_token());
  }
  if (is_letter(c)) {
    return finish(name_token());
  }
  return finish(c == '"' ? string_token() : symbol_token());
}

void Lexer::rewind(const Token& token) {
  position_ = token.begin;
  line_ = token.line;
  line_begin_ = token.begin + 1 - static_cast<std::size_t>(token.column);
  last_end_ = token.adjacent ? token.begin : std::string_view::npos;
}

Token Lexer::letter(const Token& name) {
  rewind(name);
  return finish(make(TokenKind::name, position_ + 1));
}

Token Lexer::raw_word(const Token& first) {
  rewind(first);
  constexpr std::string_view stops = "(;\",[]#$";
  std::size_t end = position_;
  while (end < text_.size() && !is_blank(text_[end]) && !is_line_end(text_[end]) &&
         stops.find(text_[end]) == std::string_view::npos) {
    ++end;
  }
  return finish(make(TokenKind::name, end));
}

Token Lexer::name_part(const Token& first) {
  rewind(first);
  std::size_t end = position_;
  if (at(end) == '+' || at(end) == '-') {
    ++end;
  }
  while (is_letter(at(end)) || is_digit(at(end))) {
    ++end;
  }
  return finish(make(TokenKind::name, end));
}

bool Lexer::skip_comment_lines(const Token& last) {
  position_ = last.end;
  while (position_ < text_.size()) {
    const bool found = ends_comment(text_.substr(position_, comment_end_limit));
    skip_to_line_end();
    if (found) {
      return true;
    }
    if (position_ < text_.size()) {
      new_line(position_ + line_end_length(position_));
    }
  }
  return false;
}

}  // namespace millrace::cnc::nc::syntax
