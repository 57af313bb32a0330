// What the interpolator writes into system data when it gets to a block: SSD, SSDE, SSDQ, SSDQInit.
//
// A queue is an array of at least three elements and a control structure with two members:
// LastFilled, the element that was written last, and LastGet, the one that was read last. They
// differ where there are messages; an element is written before LastFilled says so. A message that
// would take the place of LastGet is a runtime error and nothing is overwritten (documented,
// DOK-MTX***-NC*F*EX*V13, p. 655; that indices count from 1, and that a queue of n elements so
// holds n - 1 messages, is inferred).
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

/// The element the next message goes into. A fault if the queue has less than three elements, is
/// full, or its control structure names none of its elements (then SSDQInit is missing).
[[nodiscard]] values::Result<long> next_position(const QueueControl& control, long elements);

/// Faults: those of next_position(), and what the environment finds wrong with names and values.
values::Result<void> carry_out(const DataOrder& order, Environment& environment);

}  // namespace millrace::cnc::nc::run
