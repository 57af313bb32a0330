// The blocks that the decoder passes to the interpolator.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <variant>
#include <vector>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/event.hpp"
#include "cnc/nc/run/circle.hpp"
#include "cnc/nc/run/system_data.hpp"
#include "cnc/nc/syntax/statement.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

// The inputs of a channel's stages in each tick.

using Duration = std::chrono::nanoseconds;

struct Tick {
  /// Simulated time to advance to.
  Duration now;
  Environment& environment;
  /// Takes the events.
  const std::function<void(Event)>& emit;
};

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
  /// M52=-345
  std::optional<double> argument{};
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

// Executes a #TIMER command, in the decoder or in the interpolator.

/// The order's id must be below Timers::count.
inline void carry_out(const TimerOrder& order, Timers& timers, Duration now) {
  switch (order.action) {
    case syntax::TimerAction::start:
      timers.start(order.id, now);
      break;
    case syntax::TimerAction::stop:
      timers.stop(order.id, now);
      break;
    case syntax::TimerAction::read:
      timers.read(order.id, now);
      break;
    case syntax::TimerAction::clear:
      timers.clear(order.id);
      break;
  }
}

}  // namespace millrace::cnc::nc::run
