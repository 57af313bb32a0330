// Blocks that are written to a channel while it runs them: they replace the file when the streaming
// program is started or called (IB/tf5200_data_streaming/222568459, documented).
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <utility>

#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

class Stream {
 public:
  /// Adds one packet of whole blocks. Fault 11012 if the stream is full: write the packet again
  /// later (IB/tf5200_data_streaming/222591499, documented).
  values::Result<void> write(std::string packet) {
    if (bytes_ + packet.size() > capacity) {
      return values::fault(11012, "error writing the object: the stream is full, write it again");
    }
    bytes_ += packet.size();
    packets_.push_back(std::move(packet));
    return {};
  }
  [[nodiscard]] bool empty() const { return packets_.empty(); }
  /// Removes and returns the next packet; there must be one. Fault 21476 if its last block does not
  /// end with CR and LF (IB/tf5200_data_streaming/222589963, documented).
  values::Result<std::string> take() {
    std::string packet = std::move(packets_.front());
    packets_.pop_front();
    bytes_ -= packet.size();
    if (!packet.ends_with("\r\n")) {
      return values::fault(21476, "streaming data does not contain a correct line end marker");
    }
    return packet;
  }
  void clear() {
    packets_.clear();
    bytes_ = 0;
  }

 private:
  /// In bytes; our choice.
  static constexpr std::size_t capacity = std::size_t{64} << 10U;
  std::deque<std::string> packets_;
  std::size_t bytes_ = 0;
};

}  // namespace millrace::cnc::nc::run
