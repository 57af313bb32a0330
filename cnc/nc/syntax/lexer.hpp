// Splits a program text into tokens, one at a time.
//
// The parser pulls tokens because some depend on their context: N10G01X5 is one name to an
// expression but three words to a block. So the parser may take only the first letter of a name, or
// a raw word such as a file name, and the lexer continues after it.
//
// Comments, blanks and continued lines (\ at the line's end) separate tokens and are skipped
// (IB/tf5200_programming_manual/205979659, documented).
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

class Lexer {
 public:
  /// The text must outlive the lexer and its tokens.
  explicit Lexer(std::string_view text) : text_(text) {}

  /// Returns the token at the current position and advances past it.
  Token next();
  /// Returns only the first letter of a name and advances past it.
  Token letter(const Token& name);
  /// The characters from a token up to a blank, a comment, a bracket, a comma or a quote: a file or
  /// program name.
  Token raw_word(const Token& first);
  /// One part of a variable's name after a dot; it may begin with a digit, + or - (V.A.+SWE.X).
  Token name_part(const Token& first);
  /// Skips whole lines after a token, up to and including the line `#COMMENT END`; false if there
  /// is none.
  bool skip_comment_lines(const Token& last);

 private:
  [[nodiscard]] char at(std::size_t position) const {
    return position < text_.size() ? text_[position] : '\0';
  }
  void rewind(const Token& token);
  void skip_separators();
  void skip_bracketed_comment();
  void skip_to_line_end();
  void new_line(std::size_t next_line);
  [[nodiscard]] std::size_t line_end_length(std::size_t position) const;
  [[nodiscard]] std::size_t continued_line() const;
  [[nodiscard]] Token make(TokenKind kind, std::size_t end) const;
  [[nodiscard]] Token number_token() const;
  [[nodiscard]] Token name_token() const;
  [[nodiscard]] Token string_token() const;
  [[nodiscard]] Token symbol_token() const;
  Token finish(Token token);

  std::string_view text_;
  std::size_t position_ = 0;
  std::size_t line_begin_ = 0;
  std::size_t last_end_ = 0;
  int line_ = 1;
};

}  // namespace millrace::cnc::nc::syntax
