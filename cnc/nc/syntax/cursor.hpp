// The parser's reading head: the current token, and the mistakes found so far.
//
// After a mistake the cursor stands at the end of its block until `next_block`, so a parser need
// not unwind: every loop ends, and one run reports a mistake of each block.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/syntax/lexer.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::syntax {

class Cursor {
 public:
  /// The text must outlive the cursor; mistakes go to `mistakes`.
  Cursor(std::string file, std::string_view text, std::vector<Diagnostic>& mistakes);

  [[nodiscard]] const Token& peek() const { return token_; }
  /// The current token; the cursor goes on.
  Token take();
  /// Takes the token if it is this symbol.
  bool accept(std::string_view symbol);
  /// Takes the token if it is this name, in any case.
  bool accept_word(std::string_view word);
  /// Like accept, but a mistake if something else is there.
  void expect(std::string_view symbol);
  [[nodiscard]] bool at_word(std::string_view word) const;
  [[nodiscard]] bool at_block_end() const { return token_.ends_block(); }
  [[nodiscard]] bool at_program_end() const { return token_.kind == TokenKind::end_of_program; }

  /// Special cuts of the text, see Lexer.
  Token take_letter();
  Token take_raw_word();
  Token take_name_part();
  /// Behind `#COMMENT BEGIN`; false if its end is missing.
  bool skip_comment_lines();

  /// A mistake at the current token, or at another one of this block.
  void fail(std::string text, int id = 0);
  void fail_at(const Token& token, std::string text, int id = 0);
  /// A mistake elsewhere, that does not end the block.
  void report(int line, int column, std::string text, int id = 0);
  void report(Place place, std::string text, int id = 0);
  [[nodiscard]] bool failed() const { return failed_; }
  /// A mistake of the program that keeps nobody from reading it.
  void doubt_at(const Token& token, std::string text);
  [[nodiscard]] std::vector<Diagnostic> take_doubts() { return std::exchange(doubts_, {}); }

  /// Goes to the start of the next block; a rest of the current one is a mistake.
  void next_block();
  /// N number of the current block, for messages.
  void set_block_number(long number) { block_number_ = number; }

  /// External variables (V.E.) seen in this block.
  void note_external(ExternalUse external) { externals_.push_back(std::move(external)); }
  [[nodiscard]] const std::vector<ExternalUse>& externals() const { return externals_; }

  /// Nesting of expressions, bounded because the parser calls itself.
  bool enter();
  void leave() { --depth_; }

 private:
  void advance();

  std::string file_;
  Lexer lexer_;
  std::vector<Diagnostic>& mistakes_;
  Token token_;
  std::size_t block_begin_ = 0;
  long block_number_ = 0;
  int depth_ = 0;
  bool failed_ = false;
  std::vector<ExternalUse> externals_;
  std::vector<Diagnostic> doubts_;
};

/// What a token looks like in a message: `"X" `, "the end of the block".
[[nodiscard]] std::string describe(const Token& token);

}  // namespace millrace::cnc::nc::syntax
