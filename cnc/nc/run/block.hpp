// The blocks that the decoder passes to the interpolator.
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

/// Motion of the axes to a position, in the order of the channel's axes: straight, or two of them
/// on an arc.
struct Motion {
  std::vector<double> target;
  /// At an override of 100 %.
  Duration duration{};
  /// Length in mm.
  double path = 0;
  std::optional<Arc> arc;
};

/// A pause without motion: G04, #TIME, and the short stop of #FLUSH.
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

/// SSD, SSDE, SSDQ, SSDQInit.
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
  /// Nesting level of its routine, 0 = the main program.
  std::size_t level = 0;
  /// Blocks that the decoder had read by then, counted from the program's start.
  std::uint64_t count = 0;
  /// The block is before the one that a block search looks for: no motion.
  bool skipped = false;
};

}  // namespace millrace::cnc::nc::run
