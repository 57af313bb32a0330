// The blocks between decoder and interpolator. The last motion block may be withheld until a block
// follows it: the path preparation needs the next block for a smooth transition.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <deque>
#include <utility>

#include "cnc/nc/run/block.hpp"

namespace millrace::cnc::nc::run {

class Queue {
 public:
  /// Holds about `capacity` blocks; with `withhold` it withholds the last motion.
  Queue(std::size_t capacity, bool withhold)
      : capacity_(std::max<std::size_t>(capacity, 1)), withhold_(withhold) {}

  /// The decoder must wait. (One block of the program may still push all its parts.)
  [[nodiscard]] bool full() const { return blocks_.size() >= capacity_; }
  [[nodiscard]] bool empty() const { return blocks_.empty(); }

  /// Adds a block. It releases all blocks before it, and itself unless it is a withheld motion.
  void push(Block block) {
    const bool motion = std::holds_alternative<Motion>(block.action);
    blocks_.push_back(std::move(block));
    released_ = blocks_.size() - (motion && withhold_ ? 1 : 0);
  }

  /// Releases all blocks: #FLUSH and its variants.
  void flush() { released_ = blocks_.size(); }

  /// The next released block, null if there is none; valid until the queue changes.
  [[nodiscard]] const Block* next() const { return released_ == 0 ? nullptr : &blocks_.front(); }

  /// Removes and returns the next released block; there must be one.
  Block take() {
    assert(released_ > 0);
    Block block = std::move(blocks_.front());
    blocks_.pop_front();
    --released_;
    return block;
  }

  void clear() {
    blocks_.clear();
    released_ = 0;
  }

 private:
  std::size_t capacity_;
  bool withhold_;
  std::deque<Block> blocks_;
  std::size_t released_ = 0;
};

}  // namespace millrace::cnc::nc::run
