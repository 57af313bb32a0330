// The second stage: executes the blocks of the queue one after the other in simulated time,
// exactly, however coarse the ticks are.
#pragma once

#include <optional>
#include <vector>

#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/message_box.hpp"
#include "cnc/nc/run/queue.hpp"
#include "cnc/nc/run/tick.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

class Interpolator {
 public:
  /// The message box and the timers outlive the interpolator.
  Interpolator(std::size_t axes, MessageBox& messages, Timers& timers)
      : messages_(messages), timers_(timers), position_(axes), begin_(axes) {}

  /// Executes what ends up to the tick's time. Gives true if any block was begun or ended.
  bool advance(const Tick& tick, Queue& queue);

  /// Nothing is being executed.
  [[nodiscard]] bool idle() const { return !current_; }
  [[nodiscard]] bool held() const { return held_; }
  /// The End block was executed.
  [[nodiscard]] bool finished() const { return finished_; }
  /// The operator lets it go on after a Hold.
  void resume() { held_ = false; }
  /// Drops the current block; axes stay where they are.
  void reset();
  /// Path and blocks are counted from here.
  void start_program();

  /// Where the axes are, also while they move.
  [[nodiscard]] const std::vector<double>& position() const { return position_; }
  [[nodiscard]] MotionStatus status() const;
  /// The block in execution, or the last one.
  [[nodiscard]] const Place& place() const { return place_; }

 private:
  void begin(Block block);
  /// Executes the current block as far as it gets; true if it is done, at time_.
  bool execute(const Tick& tick);
  bool execute(const Motion& motion, const Tick& tick);
  bool execute(const Dwell& dwell, const Tick& tick);
  bool execute(const MachineFunction& function, const Tick& tick);
  bool execute(const SynchronousMessage& message, const Tick& tick);
  bool execute(const TimerOrder& order, const Tick& tick);
  bool execute(const Hold& hold, const Tick& tick);
  bool execute(const End& end, const Tick& tick);
  /// True if a block of this duration ends up to now; then that is the time.
  bool passes(Duration duration, const Tick& tick);
  /// True if what the block waits for has come; then, if it had to wait, the time is now.
  bool waits_for(bool condition, const Tick& tick);

  MessageBox& messages_;
  Timers& timers_;
  std::vector<double> position_;
  /// Where the current motion began.
  std::vector<double> begin_;
  std::optional<Block> current_;
  /// The message of the current block, once it is sent.
  std::optional<std::uint64_t> sent_;
  /// Of the last tick.
  Duration now_{};
  /// What the motions and blocks before the current one have done.
  double path_ = 0;
  std::uint64_t blocks_ = 0;
  /// Simulated time that is done, and the beginning of the current block.
  Duration time_{};
  Duration started_{};
  Place place_;
  /// The current block could not be done at once.
  bool waited_ = false;
  bool hold_announced_ = false;
  bool held_ = false;
  bool finished_ = false;
};

}  // namespace millrace::cnc::nc::run
