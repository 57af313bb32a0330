// Counts the messages of #MSG: a receiver that does not read stops the program after ten of them
// (IB/tf5200_programming_manual/507845131, documented).
#pragma once

#include <cstdint>
#include <set>

#include "cnc/nc/event.hpp"

namespace millrace::cnc::nc::run {

class MessageBox {
 public:
  /// With `read_at_once` every message counts as read and acknowledged when it is sent.
  explicit MessageBox(bool read_at_once) : read_at_once_(read_at_once) {}

  /// No further message may be sent.
  [[nodiscard]] bool full() const { return sent_ - read_ >= most_unread; }
  /// Numbers the message, which is to be emitted then; gives the number.
  std::uint64_t send(MessageEvent& message);
  /// Read up to this number.
  void read(std::uint64_t number);
  void acknowledge(std::uint64_t number);
  [[nodiscard]] bool acknowledged(std::uint64_t number) const { return !awaited_.contains(number); }
  /// The program ends: nobody waits any more, unread messages are forgotten.
  void reset();

 private:
  static constexpr std::uint64_t most_unread = 10;
  bool read_at_once_;
  std::uint64_t sent_ = 0;
  std::uint64_t read_ = 0;
  /// Messages whose acknowledge somebody waits for.
  std::set<std::uint64_t> awaited_;
};

}  // namespace millrace::cnc::nc::run
