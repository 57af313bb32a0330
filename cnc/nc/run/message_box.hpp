// Counts the messages of #MSG: the program stops after ten messages that the receiver has not read
// (IB/tf5200_programming_manual/507845131, documented).
#pragma once

#include <algorithm>
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
  /// Numbers a message before it is emitted; returns the number.
  std::uint64_t send(MessageEvent& message);
  /// Marks the messages up to this number as read.
  void read(std::uint64_t number);
  void acknowledge(std::uint64_t number);
  [[nodiscard]] bool acknowledged(std::uint64_t number) const { return !awaited_.contains(number); }
  /// The program ends: waits for no acknowledgement, counts all messages as read.
  void reset();

 private:
  static constexpr std::uint64_t most_unread = 10;
  bool read_at_once_;
  std::uint64_t sent_ = 0;
  std::uint64_t read_ = 0;
  /// Messages whose acknowledgement is pending.
  std::set<std::uint64_t> awaited_;
};

inline std::uint64_t MessageBox::send(MessageEvent& message) {
  message.number = ++sent_;
  if (read_at_once_) {
    read_ = sent_;
  } else if (message.needs_acknowledge) {
    awaited_.insert(sent_);
  }
  return sent_;
}

inline void MessageBox::read(std::uint64_t number) {
  read_ = std::clamp(number, read_, sent_);
}

inline void MessageBox::acknowledge(std::uint64_t number) {
  awaited_.erase(number);
  read(number);
}

inline void MessageBox::reset() {
  read_ = sent_;
  awaited_.clear();
}

}  // namespace millrace::cnc::nc::run
