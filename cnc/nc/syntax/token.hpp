// The tokens of an NC program.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace millrace::cnc::nc::syntax {

enum class TokenKind {
  end_of_program,
  end_of_block,
  number,
  name,    // letters, digits and _, starting with a letter; `P12` is the name P and the number 12
  string,  // "…" with \" for a quote inside, \\ for a backslash at the end
  symbol,  // an operator or separator, two characters if the language has one
  invalid  // text is the mistake
};

/// A token with its place. Its views point into the program text.
struct Token {
  TokenKind kind = TokenKind::end_of_program;
  /// As written (a name, a symbol), or the message of an invalid token.
  std::string_view text;
  double number = 0;
  /// Position of the first byte, and of the first byte after the token.
  std::size_t begin = 0;
  std::size_t end = 0;
  int line = 1;
  int column = 1;
  /// No separator is between it and the previous token.
  bool adjacent = false;

  /// True if it is this symbol.
  [[nodiscard]] bool is(std::string_view symbol) const {
    return kind == TokenKind::symbol && text == symbol;
  }
  [[nodiscard]] bool ends_block() const {
    return kind == TokenKind::end_of_block || kind == TokenKind::end_of_program;
  }
};

/// The content of a string token without its quotes. Before a quotation mark \\ is a backslash and
/// \" is the mark; elsewhere a backslash is one.
[[nodiscard]] std::string unquote(std::string_view quoted);

}  // namespace millrace::cnc::nc::syntax
