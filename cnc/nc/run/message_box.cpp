#include "cnc/nc/run/message_box.hpp"

#include <algorithm>

namespace millrace::cnc::nc::run {

std::uint64_t MessageBox::send(MessageEvent& message) {
  message.number = ++sent_;
  if (read_at_once_) {
    read_ = sent_;
  } else if (message.needs_acknowledge) {
    awaited_.insert(sent_);
  }
  return sent_;
}

void MessageBox::read(std::uint64_t number) {
  read_ = std::clamp(number, read_, sent_);
}

void MessageBox::acknowledge(std::uint64_t number) {
  awaited_.erase(number);
  read(number);
}

void MessageBox::reset() {
  read_ = sent_;
  awaited_.clear();
}

}  // namespace millrace::cnc::nc::run
