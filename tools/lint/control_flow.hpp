// The operations that may follow each operation of a routine, and its loops. Pure.
//
//   const ControlFlow flow(routine);
//   for (const std::size_t next : flow.behind(7)) …
//   if (const Loop* loop = flow.innermost(7)) …
#pragma once

#include <cstddef>
#include <vector>

#include "cnc/nc/syntax/program.hpp"

namespace millrace::tools::lint {

/// From the target of a jump back to that jump, both included.
struct Loop {
  std::size_t first = 0;
  std::size_t last = 0;
  [[nodiscard]] bool has(std::size_t operation) const {
    return first <= operation && operation <= last;
  }
};

class ControlFlow {
 public:
  explicit ControlFlow(const cnc::nc::syntax::Routine& routine);

  /// The operations that may come next; the number of operations means the routine's end.
  [[nodiscard]] const std::vector<std::size_t>& behind(std::size_t operation) const {
    return behind_[operation];
  }
  /// Does it only continue at one other place?
  [[nodiscard]] bool jumps(std::size_t operation) const {
    return operation < jumps_.size() && jumps_[operation];
  }
  /// The smallest loop that has the operation; null if none has.
  [[nodiscard]] const Loop* innermost(std::size_t operation) const;
  /// Does the path to this operation leave the loop, perhaps by a jump ($BREAK)?
  [[nodiscard]] bool leaves(const Loop& loop, std::size_t operation) const;

 private:
  std::vector<std::vector<std::size_t>> behind_;
  std::vector<bool> jumps_;
  /// By their size, the smallest first.
  std::vector<Loop> loops_;
};

}  // namespace millrace::tools::lint
