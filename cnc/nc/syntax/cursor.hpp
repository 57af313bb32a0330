// The parser's cursor: the current token, and the mistakes found so far.
//
// After a mistake the cursor is at the end of its block until `next_block`, so a parser need not
// unwind: every loop ends, and one run reports a mistake of each block.
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
  /// The text must outlive the cursor; mistakes are added to `mistakes`.
  Cursor(std::string file, std::string_view text, std::vector<Diagnostic>& mistakes);

  [[nodiscard]] const Token& peek() const { return token_; }
  /// A later token of the block: 1 is the next one.
  [[nodiscard]] Token peek_ahead(int count) const;
  /// Returns the current token and advances.
  Token take();
  /// Takes the token if it is this symbol.
  bool accept(std::string_view symbol);
  /// Takes the token if it is this name, case-insensitive.
  bool accept_word(std::string_view word);
  /// Like accept(), but any other token is a mistake.
  void expect(std::string_view symbol);
  [[nodiscard]] bool at_word(std::string_view word) const;
  [[nodiscard]] bool at_block_end() const { return token_.ends_block(); }
  [[nodiscard]] bool at_program_end() const { return token_.kind == TokenKind::end_of_program; }

  /// Special tokens, see Lexer.
  Token take_letter();
  Token take_raw_word();
  Token take_name_part();
  /// Call it after `#COMMENT BEGIN`; false if the end is missing.
  bool skip_comment_lines();
  /// Within brackets over several lines, at the end of a line: goes on behind lines without words,
  /// and to a `]` on a line of its own, as the vendor's editor does (isg-stuttgart/vscode-isg-cnc).
  /// Behind a comma it goes on with the next line, whatever that is.
  void continue_brackets(bool behind_comma = false);
  /// Goes from a `[` behind its `]`.
  void skip_brackets();
  /// Goes to the end of the block.
  void skip_block();

  /// A mistake at the current token, or at another one of this block.
  void fail(std::string text, int id = 0);
  void fail_at(const Token& token, std::string text, int id = 0);
  /// The virtual CNC lacks it; a controller may have it.
  void fail_unknown(std::string text);
  void fail_unknown_at(const Token& token, std::string text);
  /// A mistake elsewhere that does not end the block.
  void report(int line, int column, std::string text, int id = 0);
  void report(Place place, std::string text, int id = 0);
  [[nodiscard]] bool failed() const { return failed_; }
  /// A mistake that does not prevent the parsing of the program.
  void doubt_at(const Token& token, std::string text);
  [[nodiscard]] std::vector<Diagnostic> take_doubts() { return std::exchange(doubts_, {}); }

  /// A rest of the block is a mistake.
  void finish_block();
  /// Finishes the block and goes to the start of the next one.
  void next_block();
  /// The current block up to the token.
  [[nodiscard]] std::string_view block_text() const;
  [[nodiscard]] std::vector<int> take_lines_with_mistakes() {
    return std::exchange(lines_with_mistakes_, {});
  }
  /// N number of the current block, for messages.
  void set_block_number(long number) { block_number_ = number; }

  /// External variables (V.E.) in this block.
  void note_external(ExternalUse external) { externals_.push_back(std::move(external)); }
  [[nodiscard]] const std::vector<ExternalUse>& externals() const { return externals_; }

  /// Nesting of expressions, limited because the parser is recursive.
  bool enter();
  void leave() { --depth_; }

 private:
  void advance();

  std::string file_;
  std::string_view text_;
  Lexer lexer_;
  std::vector<Diagnostic>& mistakes_;
  Token token_;
  std::size_t block_begin_ = 0;
  long block_number_ = 0;
  int depth_ = 0;
  bool failed_ = false;
  std::vector<int> lines_with_mistakes_;
  std::vector<ExternalUse> externals_;
  std::vector<Diagnostic> doubts_;
};

/// A token in a message: `"X" `, "the end of the block".
[[nodiscard]] std::string describe(const Token& token);

}  // namespace millrace::cnc::nc::syntax
