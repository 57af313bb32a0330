// The second stage: executes the blocks of the queue one after the other in simulated time. The
// times are exact, independent of the tick period.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/block.hpp"
#include "cnc/nc/run/message_box.hpp"
#include "cnc/nc/run/queue.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

class Interpolator {
 public:
  /// `rapid` is the time of a millimetre of rapid motion. The message box and the timers must
  /// outlive the interpolator.
  Interpolator(std::size_t axes, std::chrono::duration<double> rapid, MessageBox& messages,
               Timers& timers)
      : rapid_(rapid), messages_(messages), timers_(timers), position_(axes), begin_(axes) {}

  /// Executes the blocks that end up to the tick's time. Returns true if any block was begun or
  /// ended.
  bool advance(const Tick& tick, Queue& queue);

  /// No block is being executed.
  [[nodiscard]] bool idle() const { return !current_; }
  [[nodiscard]] bool held() const { return held_; }
  /// Returns the fault of the current block, once; after a fault it executes no further block.
  [[nodiscard]] std::optional<Fault> take_fault() { return std::exchange(fault_, std::nullopt); }
  /// The End block was executed.
  [[nodiscard]] bool finished() const { return finished_; }
  /// The operator continues after a Hold.
  void resume() { held_ = false; }
  /// Drops the current block; axes stay where they are.
  void reset();
  /// Begins to count the path of a program.
  void start_program();
  /// Factor on the feed of every motion from the last tick on, 0 or more (1 = 100 %).
  void set_feed_override(double factor);
  [[nodiscard]] double feed_override() const { return override_; }
  /// Stops before each block until it is resumed, as the mode requires.
  void set_single_step(SingleStep step) { step_ = step; }
  [[nodiscard]] SingleStep single_step() const { return step_; }

  /// Positions of the axes, also during a motion.
  [[nodiscard]] const std::vector<double>& position() const { return position_; }
  [[nodiscard]] MotionStatus status() const;
  /// Target of the current block, and speed of each axis in mm/s.
  [[nodiscard]] const std::vector<double>& target() const;
  [[nodiscard]] std::vector<double> velocities() const;
  /// Place of the current or last block.
  [[nodiscard]] const Place& place() const { return place_; }

 private:
  /// Begins the next block, or the motion to its start.
  void begin_next(Queue& queue);
  /// Passes over a block before the one that a block search looks for.
  void skip(const Block& block, const Tick& tick);
  /// False while it must stop before this block.
  bool may_begin(const Block& block, const Tick& tick);
  [[nodiscard]] bool stops_before(const Block& block) const;
  void begin(Block block);
  /// Executes the current block as far as possible; true if it is complete, at time_.
  bool execute(const Tick& tick);
  bool execute(const Motion& motion, const Tick& tick);
  bool execute(const Dwell& dwell, const Tick& tick);
  bool execute(const MachineFunction& function, const Tick& tick);
  bool execute(const SynchronousMessage& message, const Tick& tick);
  bool execute(const TimerOrder& order, const Tick& tick);
  bool execute(const DataWrite& write, const Tick& tick);
  bool execute(const Hold& hold, const Tick& tick);
  bool execute(const End& end, const Tick& tick);
  /// The part of the current motion or dwell that is complete at a time, in time at an override of
  /// 100 %.
  [[nodiscard]] Duration done_by(Duration time, double factor) const;
  /// True if a block of this duration ends by now; then sets time_ to its end.
  bool passes(Duration duration, double factor, const Tick& tick);
  /// Sets the axes to their positions at a fraction of the motion, 0 to 1.
  void go_to(const Motion& motion, double part);
  /// True if the condition of the block is met; if it had to wait, time_ becomes the current time.
  bool waits_for(bool condition, const Tick& tick);

  std::chrono::duration<double> rapid_;
  MessageBox& messages_;
  Timers& timers_;
  std::vector<double> position_;
  /// Start of the current motion.
  std::vector<double> begin_;
  std::optional<Block> current_;
  /// Number of the current block's message, once it is sent.
  std::optional<std::uint64_t> sent_;
  /// Time of the last tick.
  Duration now_{};
  /// Path of the motions before the current one, in mm.
  double path_ = 0;
  /// Completed fraction of the current motion.
  double part_ = 0;
  /// Simulated time up to which everything is executed.
  Duration time_{};
  /// Time at which the current block began or its override changed; `done_` is the part that was
  /// complete then.
  Duration since_{};
  Duration done_{};
  double override_ = 1;
  Place place_;
  std::uint64_t count_ = 0;
  /// Target of the skipped blocks of a block search.
  std::optional<std::vector<double>> approach_;
  SingleStep step_;
  /// It has stopped before the next block.
  bool step_announced_ = false;
  /// Level of the block before which it stopped last, or of the last block.
  std::size_t level_ = 0;
  /// The current block could not be completed at once.
  bool waited_ = false;
  bool hold_announced_ = false;
  bool held_ = false;
  bool finished_ = false;
  std::optional<Fault> fault_;
};

}  // namespace millrace::cnc::nc::run
