// Collects the operations of a routine during parsing.
#pragma once

#include <optional>
#include <utility>

#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::syntax {

/// The part of a block before its statement.
struct BlockHead {
  int line = 0;
  int column = 0;
  std::optional<Expression> number;
  std::uint8_t skip_level = 0;
};

class RoutineWriter {
 public:
  explicit RoutineWriter(Routine& routine) : routine_(&routine) {}

  /// Continues with another routine.
  void begin_routine(Routine& routine) { routine_ = &routine; }

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

}  // namespace millrace::cnc::nc::syntax
