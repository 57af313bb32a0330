// Parses $ statements and reduces them to jumps (IB/tf5200_programming_manual/206901003 and the
// pages after it). All of them are in one table in control_parser.cpp.
#pragma once

#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::syntax {

/// The part of a block before its statement.
struct BlockHead {
  int line = 0;
  int column = 0;
  std::optional<Expression> number;
  std::uint8_t skip_level = 0;
};

/// Collects the operations of a routine during parsing.
class RoutineWriter {
 public:
  explicit RoutineWriter(Routine& routine) : routine_(&routine) {}

  /// Continues with another routine.
  void begin_routine(Routine& routine) {
    routine_ = &routine;
    block_begin_ = next();
  }

  /// The following operations belong to this block.
  void begin_block(BlockHead head) {
    head_ = std::move(head);
    block_begin_ = next();
  }
  /// The operations of the block use these external variables.
  void note_externals(const std::vector<ExternalUse>& externals) {
    for (std::size_t i = block_begin_; i < next(); ++i) {
      routine_->operations[i].externals = externals;
    }
  }
  [[nodiscard]] const BlockHead& head() const { return head_; }

  /// The block has a mistake, and may do more than its operations show.
  void mark_unclear() {
    if (block_begin_ == next()) {
      add(Skipped{});
    }
    routine_->operations.back().unclear = true;
  }

  /// Adds an operation and returns its index. The first operation of a block has the N number.
  std::size_t add(Statement statement) {
    routine_->operations.push_back({head_.line,
                                    head_.column,
                                    std::exchange(head_.number, {}),
                                    head_.skip_level,
                                    {},
                                    std::move(statement)});
    return routine_->operations.size() - 1;
  }
  /// Index of the next operation.
  [[nodiscard]] std::size_t next() const { return routine_->operations.size(); }
  /// The statement of an earlier operation, which must be a T.
  template <class T>
  T& at(std::size_t index) {
    return std::get<T>(routine_->operations[index].statement);
  }
  [[nodiscard]] Routine& routine() { return *routine_; }

 private:
  Routine* routine_;
  BlockHead head_;
  std::size_t block_begin_ = 0;
};

class ControlParser {
 public:
  ControlParser(Cursor& cursor, RoutineWriter& writer) : cursor_(cursor), writer_(writer) {}

  /// A statement after its `$`.
  void parse();
  /// The routine ends: open statements are mistakes.
  void finish();

 private:
  enum class Kind { if_, while_, do_, repeat, for_, switch_ };

  /// A statement without its end yet.
  struct Open {
    Kind kind{};
    int line = 0;
    int column = 0;
    /// First operation of the loop, or the Switch.
    std::size_t begin = 0;
    /// $IF: the Branch of the open part; none after $ELSE.
    std::size_t branch = none;
    /// Jumps and branches that leave it.
    std::vector<std::size_t> exits;
    /// Jumps of $CONTINUE.
    std::vector<std::size_t> continues;
  };
  struct Keyword {
    std::string_view name;
    void (ControlParser::*parse)();
  };
  static const std::vector<Keyword>& keywords();
  static std::string_view opening_word(Kind kind);

  void parse_if();
  void parse_elseif();
  void parse_else();
  void parse_endif();
  void parse_while();
  void parse_endwhile();
  void parse_do();
  void parse_enddo();
  void parse_repeat();
  void parse_until();
  void parse_for();
  void parse_endfor();
  void parse_switch();
  void parse_case();
  void parse_default();
  void parse_endswitch();
  void parse_break();
  void parse_continue();
  void parse_goto();

  void open(Kind kind, std::size_t begin);
  /// The innermost open statement of this kind, or null. Reports a mistake if another statement is
  /// open inside.
  Open* innermost(Kind kind);
  /// Ends the innermost statement: directs its exits to the next operation.
  void close();
  void patch(const std::vector<std::size_t>& operations, std::size_t target);
  void set_target(std::size_t operation, std::size_t target);
  void begin_if_part(Open& statement);

  Cursor& cursor_;
  RoutineWriter& writer_;
  /// The current word, for messages.
  Token word_;
  std::vector<Open> open_;

  static constexpr std::size_t none = static_cast<std::size_t>(-1);
};

}  // namespace millrace::cnc::nc::syntax
