// What the decoder hands to the interpolator.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <variant>
#include <vector>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/event.hpp"
#include "cnc/nc/run/circle.hpp"
#include "cnc/nc/run/system_data.hpp"
#include "cnc/nc/run/tick.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::run {

/// Axes go to a position, in the order of the channel's axes: straight, or two of them on an arc.
struct Motion {
  std::vector<double> target;
  /// At an override of 100 %.
  Duration duration{};
  /// Its length in mm.
  double path = 0;
  std::optional<Arc> arc;
};

/// Nothing moves: G04, #TIME, and the short stop of #FLUSH.
struct Dwell {
  Duration duration{};
};

/// An M function of the machine.
struct MachineFunction {
  int number = 0;
};

/// #MSG SYN and SYN_ACK
struct SynchronousMessage {
  MessageEvent message;
};

/// #TIMER … SYN
struct TimerOrder {
  syntax::TimerAction action{};
  std::size_t id = 0;
};

/// SSD and its relatives.
struct DataWrite {
  DataOrder order;
};

/// M00, M01: the interpolator waits for the operator.
struct Hold {};

/// The program's last block.
struct End {};

struct Block {
  using Action = std::variant<Motion, Dwell, MachineFunction, SynchronousMessage, TimerOrder,
                              DataWrite, Hold, End>;
  Action action;
  Place place;
  /// Routines above the one it stands in.
  std::size_t level = 0;
  /// Blocks the decoder had read by then, counted from the program's start.
  std::uint64_t count = 0;
  /// It stands before the block that is searched for: nothing moves.
  bool skipped = false;
};

}  // namespace millrace::cnc::nc::run
