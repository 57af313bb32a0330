// The second stage: executes the blocks of the queue one after the other in simulated time,
// exactly, however coarse the ticks are.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/message_box.hpp"
#include "cnc/nc/run/queue.hpp"
#include "cnc/nc/run/tick.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc::run {

class Interpolator {
 public:
  /// `rapid` is the time of a millimetre of rapid motion. The message box and the timers outlive
  /// the interpolator.
  Interpolator(std::size_t axes, std::chrono::duration<double> rapid, MessageBox& messages,
               Timers& timers)
      : rapid_(rapid), messages_(messages), timers_(timers), position_(axes), begin_(axes) {}

  /// Executes what ends up to the tick's time. Gives true if any block was begun or ended.
  bool advance(const Tick& tick, Queue& queue);

  /// Nothing is being executed.
  [[nodiscard]] bool idle() const { return !current_; }
  [[nodiscard]] bool held() const { return held_; }
  /// What went wrong in the block in hand, once; then it executes nothing more.
  [[nodiscard]] std::optional<Fault> take_fault() { return std::exchange(fault_, std::nullopt); }
  /// The End block was executed.
  [[nodiscard]] bool finished() const { return finished_; }
  /// The operator lets it go on after a Hold.
  void resume() { held_ = false; }
  /// Drops the current block; axes stay where they are.
  void reset();
  /// The path is counted from here.
  void start_program();
  /// Factor on the feed of every motion from the last tick on, 0 or more (1 = 100 %).
  void set_feed_override(double factor);
  [[nodiscard]] double feed_override() const { return override_; }
  /// Stops before blocks until it is resumed, one after the other.
  void set_single_step(SingleStep step) { step_ = step; }
  [[nodiscard]] SingleStep single_step() const { return step_; }

  /// Where the axes are, also while they move.
  [[nodiscard]] const std::vector<double>& position() const { return position_; }
  [[nodiscard]] MotionStatus status() const;
  /// Where they go in the current block, and how fast each of them is, in mm/s.
  [[nodiscard]] const std::vector<double>& target() const;
  [[nodiscard]] std::vector<double> velocities() const;
  /// The block in execution, or the last one.
  [[nodiscard]] const Place& place() const { return place_; }

 private:
  /// Begins the next block, or the way to where it begins.
  void begin_next(Queue& queue);
  /// Goes over a block that stands before the one that is searched for.
  void skip(const Block& block, const Tick& tick);
  /// False while it must stop before this block.
  bool may_begin(const Block& block, const Tick& tick);
  [[nodiscard]] bool stops_before(const Block& block) const;
  void begin(Block block);
  /// Executes the current block as far as it gets; true if it is done, at time_.
  bool execute(const Tick& tick);
  bool execute(const Motion& motion, const Tick& tick);
  bool execute(const Dwell& dwell, const Tick& tick);
  bool execute(const MachineFunction& function, const Tick& tick);
  bool execute(const SynchronousMessage& message, const Tick& tick);
  bool execute(const TimerOrder& order, const Tick& tick);
  bool execute(const DataWrite& write, const Tick& tick);
  bool execute(const Hold& hold, const Tick& tick);
  bool execute(const End& end, const Tick& tick);
  /// Of the current motion or dwell, at an override of 100 %: what is done of it by a time.
  [[nodiscard]] Duration done_by(Duration time, double factor) const;
  /// True if a block of this duration ends up to now; then that is the time.
  bool passes(Duration duration, double factor, const Tick& tick);
  /// Puts the axes where they are at a share of the motion, 0 to 1.
  void go_to(const Motion& motion, double part);
  /// True if what the block waits for has come; then, if it had to wait, the time is now.
  bool waits_for(bool condition, const Tick& tick);

  std::chrono::duration<double> rapid_;
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
  /// Of the motions before the current one, in mm.
  double path_ = 0;
  /// Share of the current motion that is done.
  double part_ = 0;
  /// Simulated time that is done.
  Duration time_{};
  /// The current block began here, or its override changed: `done_` was done by then.
  Duration since_{};
  Duration done_{};
  double override_ = 1;
  Place place_;
  std::uint64_t count_ = 0;
  /// Where the blocks that were skipped would have led.
  std::optional<std::vector<double>> approach_;
  SingleStep step_;
  /// It has stopped before the next block.
  bool step_announced_ = false;
  /// Of the block it has stopped before last, or of the last one.
  std::size_t level_ = 0;
  /// The current block could not be done at once.
  bool waited_ = false;
  bool hold_announced_ = false;
  bool held_ = false;
  bool finished_ = false;
  std::optional<Fault> fault_;
};

}  // namespace millrace::cnc::nc::run
