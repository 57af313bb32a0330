// The writes of the interpolator to system data when it reaches a block: SSD, SSDE, SSDQ, SSDQInit.
//
// A queue is an array of at least three elements and a control structure with two members:
// LastFilled, the last written element, and LastGet, the last read one. They differ while there are
// messages. An element is written before LastFilled. A message that would overwrite the element of
// LastGet is a runtime error, and nothing is written (documented, DOK-MTX***-NC*F*EX*V13, p. 655;
// inferred: indices count from 1, so a queue of n elements holds n - 1 messages).
#pragma once

#include <string>
#include <variant>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

/// SSD, SSDE
struct AssignData {
  std::string name;
  Value value;
};

/// SSDQ
struct WriteMessage {
  std::string queue;
  std::string control;
  Value value;
};

/// SSDQInit: both members become 1 (documented).
struct InitQueue {
  std::string control;
};

using DataOrder = std::variant<AssignData, WriteMessage, InitQueue>;

struct QueueControl {
  long last_filled = 1;
  long last_get = 1;
};

/// The element for the next message. A fault if the queue has less than three elements, is full, or
/// its control structure contains an invalid element (then SSDQInit is missing).
[[nodiscard]] values::Result<long> next_position(const QueueControl& control, long elements);

/// Faults: those of next_position(), and those of the environment for names and values.
values::Result<void> carry_out(const DataOrder& order, Environment& environment);

}  // namespace millrace::cnc::nc::run
