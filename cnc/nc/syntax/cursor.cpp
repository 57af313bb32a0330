#include "cnc/nc/syntax/cursor.hpp"

#include <utility>

#include "cnc/nc/characters.hpp"

namespace millrace::cnc::nc::syntax {
namespace {

// Limit of the kernel's reader (IB/tf5200_diagnosis/1250485899, documented).
constexpr std::size_t longest_block = 4096;
constexpr int deepest_expression = 100;
constexpr std::size_t most_mistakes = 100;

}  // namespace

std::string describe(const Token& token) {
  switch (token.kind) {
    case TokenKind::end_of_program:
      return "the end of the program";
    case TokenKind::end_of_block:
      return "the end of the block";
    default:
      return "'" + std::string(token.text) + "'";
  }
}

Cursor::Cursor(std::string file, std::string_view text, std::vector<Diagnostic>& mistakes)
    : file_(std::move(file)), text_(text), lexer_(text), mistakes_(mistakes) {
  token_ = lexer_.next();
}

void Cursor::advance() {
  if (token_.ends_block()) {
    return;  // only next_block() leaves a block
  }
  token_ = lexer_.next();
  if (token_.begin - block_begin_ > longest_block) {
    fail("the block is longer than " + std::to_string(longest_block) + " characters", 20301);
  }
}

Token Cursor::take() {
  Token taken = token_;
  advance();
  return taken;
}

bool Cursor::accept(std::string_view symbol) {
  if (!token_.is(symbol)) {
    return false;
  }
  advance();
  return true;
}

bool Cursor::at_word(std::string_view word) const {
  return token_.kind == TokenKind::name && same_word(token_.text, word);
}

bool Cursor::accept_word(std::string_view word) {
  if (!at_word(word)) {
    return false;
  }
  advance();
  return true;
}

void Cursor::expect(std::string_view symbol) {
  if (!accept(symbol)) {
    fail("'" + std::string(symbol) + "' expected before " + describe(token_));
  }
}

Token Cursor::take_letter() {
  Token letter = lexer_.letter(token_);
  advance();
  return letter;
}

Token Cursor::take_raw_word() {
  Token word = lexer_.raw_word(token_);
  advance();
  return word;
}

Token Cursor::take_name_part() {
  Token part = lexer_.name_part(token_);
  advance();
  return part;
}

Token Cursor::peek_ahead(int count) const {
  Lexer lexer = lexer_;
  Token token = token_;
  for (; count > 0 && !token.ends_block(); --count) {
    token = lexer.next();
  }
  return token;
}

void Cursor::continue_brackets(bool behind_comma) {
  if (failed_ || token_.kind != TokenKind::end_of_block) {
    return;
  }
  const auto before = static_cast<std::size_t>(token_.column) - 1;
  const bool empty_line =
      Lexer(text_.substr(token_.begin - before, before)).next().kind == TokenKind::end_of_program;
  Lexer lexer = lexer_;
  Token token = token_;
  while (token.kind == TokenKind::end_of_block) {
    token = lexer.next();
  }
  if (token.kind != TokenKind::end_of_program && (behind_comma || empty_line || token.is("]"))) {
    lexer_ = lexer;
    token_ = token;
  }
}

void Cursor::skip_brackets() {
  expect("[");
  for (int depth = 1; depth > 0 && !at_block_end(); advance()) {
    depth += token_.is("[") ? 1 : 0;
    depth -= token_.is("]") ? 1 : 0;
    if (depth == 0) {
      break;
    }
  }
  expect("]");
}

void Cursor::skip_block() {
  while (!at_block_end()) {
    advance();
  }
}

bool Cursor::skip_comment_lines() {
  if (at_program_end()) {
    return false;
  }
  const bool found = lexer_.skip_comment_lines(token_);
  token_ = lexer_.next();
  block_begin_ = token_.begin;
  return found;
}

void Cursor::fail(std::string text, int id) {
  fail_at(token_, std::move(text), id);
}

void Cursor::fail_at(const Token& token, std::string text, int id) {
  if (failed_) {
    return;
  }
  failed_ = true;
  if (token.kind == TokenKind::invalid) {
    text = token.text;
  }
  report(token.line, token.column, std::move(text), id);
  while (!token_.ends_block()) {
    token_ = lexer_.next();
  }
}

void Cursor::fail_unknown(std::string text) {
  fail_unknown_at(token_, std::move(text));
}

void Cursor::fail_unknown_at(const Token& token, std::string text) {
  const std::size_t before = mistakes_.size();
  fail_at(token, std::move(text));
  if (mistakes_.size() > before) {
    mistakes_.back().unknown = true;
  }
}

void Cursor::report(int line, int column, std::string text, int id) {
  report({file_, line, column, block_number_}, std::move(text), id);
}

void Cursor::report(Place place, std::string text, int id) {
  if (mistakes_.size() < most_mistakes) {
    mistakes_.push_back({std::move(place), id, std::move(text)});
  }
}

void Cursor::doubt_at(const Token& token, std::string text) {
  if (doubts_.size() < most_mistakes) {
    doubts_.push_back({{file_, token.line, token.column, block_number_}, 0, std::move(text)});
  }
}

void Cursor::finish_block() {
  if (!at_block_end()) {
    fail(describe(token_) +
         (token_.is("=") ? " is not expected here; '==' compares" : " is not expected here"));
  }
}

std::string_view Cursor::block_text() const {
  return text_.substr(block_begin_, token_.begin - block_begin_);
}

void Cursor::next_block() {
  finish_block();
  if (failed_) {
    lines_with_mistakes_.push_back(token_.line);
  }
  failed_ = false;
  externals_.clear();
  block_number_ = 0;
  depth_ = 0;
  if (!at_program_end()) {
    token_ = lexer_.next();
  }
  block_begin_ = token_.begin;
}

bool Cursor::enter() {
  if (++depth_ > deepest_expression) {
    fail("the expression is nested deeper than " + std::to_string(deepest_expression) + " levels");
    return false;
  }
  return true;
}

}  // namespace millrace::cnc::nc::syntax
