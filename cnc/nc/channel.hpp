// One NC channel: a decoder that runs ahead of an interpolator, driven by ticks.
//
//   Channel channel;
//   if (auto started = channel.start("demo.nc", text); !started)
//     for (const Diagnostic& mistake : started.error()) std::cerr << mistake.to_string() << '\n';
//   while (channel.active())
//     for (const Event& event : channel.tick(now, environment)) …   // messages, the end …
//
// Pure: no clock, no file, no thread. Variables, $-statements and #MSG take effect when the decoder
// reaches them, motion when the interpolator does; the queue between them is bounded
// (IB/tf5200_programming_manual/207042443, documented).
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/event.hpp"
#include "cnc/nc/motion.hpp"
#include "cnc/nc/run/decoder.hpp"
#include "cnc/nc/timers.hpp"

namespace millrace::cnc::nc {

struct ChannelOptions {
  /// Blocks between decoder and interpolator ("up to about 70", ISG/207421579, documented).
  std::size_t queue = 70;
  /// The last motion block waits for a following block, a flush or the end of the program. So a
  /// #WAIT FOR without #FLUSH may wait for ever (IB/tf5200_programming_manual/207058059,
  /// documented).
  bool withhold_last_motion = true;
  /// #FLUSH CONTINUE waits for the end of all motion, as a comment in the vendor's sample states
  /// (IB/tf5200_service_interface/356533387). By the programming manual it does not wait
  /// (IB/tf5200_programming_manual/207042443, documented).
  bool flush_continue_waits = false;
  /// Factor on simulated motion and dwell time: 0 = they take no time, 2 = twice as long.
  double time_scale = 1.0;
  /// Cycle of the interpolator: a motion with a message of a queue (SSDQ) takes at least one.
  std::chrono::nanoseconds cycle = std::chrono::milliseconds(1);
  /// The most decoder operations in one tick, so that an endless loop does not block other
  /// channels.
  std::size_t decoder_budget = 200;
  /// Axes of the channel, in the order of Channel::axes().
  std::vector<std::string> axes = {"X", "Y", "Z"};
  /// In the order of the axes; axes without an entry are unlimited. A block that leaves the limits
  /// is a fault.
  std::vector<AxisLimits> limits;
  /// Speed of G00 in mm/min.
  double rapid_feed = 10'000;
  /// Each message counts as read and acknowledged at once. Otherwise the program stops after ten
  /// unread messages, and waits for each acknowledgement that it requested.
  bool messages_read_at_once = true;
  /// M01 stops.
  bool optional_stop = false;
  /// Blocks marked with / or /n are skipped if bit n-1 is set (level 1 to 10; / alone is 1).
  std::uint16_t skipped_levels = 0;
  /// The program or subprogram of this name is read from Channel::stream; empty = none
  /// (P-CHAN-00158, IB/tf5200_data_streaming/222568459, documented).
  std::string stream_program;
};

enum class ChannelState { idle, active, held, error };

/// Position of an axis, in mm or degrees.
struct AxisPosition {
  std::string name;
  double position = 0;
  /// Position at the end of the current block.
  double target = 0;
  /// In mm/s or degrees/s.
  double velocity = 0;
};

class Channel {
 public:
  /// Channels of one controller share their timers; without `timers` the channel has its own.
  explicit Channel(ChannelOptions options = {}, std::shared_ptr<Timers> timers = nullptr);
  ~Channel() = default;
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  /// Parses and starts a main program, or returns all its mistakes. Fails unless the channel is
  /// idle.
  tl::expected<void, std::vector<Diagnostic>> start(const std::string& file,
                                                    const std::string& text);
  /// NC reset: the program ends, an error is cleared, axes stay where they are. It cannot clear an
  /// error that needs a restart (AbortedEvent::restart_needed): make a new channel.
  void reset();
  /// Ends the running program by an external error; the channel is in error until it is reset.
  /// Nullopt if no program runs.
  std::optional<AbortedEvent> abort(Fault fault);
  /// Continues after M00, M01 or a single step.
  void resume();
  /// Factor on the feed of all motions, including rapid ones (our choice); 1 is 100 %, 0 stops
  /// them.
  void set_feed_override(double factor) { interpolator_.set_feed_override(factor); }
  [[nodiscard]] double feed_override() const { return interpolator_.feed_override(); }
  void set_single_step(SingleStep step) { interpolator_.set_single_step(step); }
  [[nodiscard]] SingleStep single_step() const { return interpolator_.single_step(); }
  /// Block search from the next start on. The decoder works as usual, but before the first block
  /// with this number there is no motion, no M function and no #MSG SYN. Then the axes move to its
  /// start by rapid motion (our choice). #FLUSH WAIT before it is fault 50748
  /// (IB/tf5200_programming_manual/207042443, documented).
  void set_block_search(std::optional<long> block) { search_ = block; }
  [[nodiscard]] bool searching() const { return decoder_.searching(); }
  /// As in the options: M01 from the next block on, the skipped levels from the next start on.
  void set_optional_stop(bool on);
  [[nodiscard]] bool optional_stop() const { return options_.optional_stop; }
  void set_skipped_levels(std::uint16_t levels) { options_.skipped_levels = levels; }
  [[nodiscard]] std::uint16_t skipped_levels() const { return options_.skipped_levels; }
  /// Adds a packet of whole blocks, each ended by CR and LF, to the input of the streaming program.
  /// $ statements that belong together must be in one packet (our choice). Fault 11012 if the
  /// stream is full.
  tl::expected<void, Fault> stream(std::string packet) { return stream_.write(std::move(packet)); }
  /// The receiver has read the messages up to this number (MessageEvent::number).
  void read_messages(std::uint64_t number) { messages_.read(number); }
  /// The operator acknowledges a message; this also marks it as read.
  void acknowledge(std::uint64_t number) { messages_.acknowledge(number); }

  /// Advances decoder and interpolator to `now` (any monotonic origin). The decoder executes at
  /// most `operations`, and never more than the options allow.
  std::vector<Event> tick(std::chrono::nanoseconds now, Environment& environment,
                          std::size_t operations = std::numeric_limits<std::size_t>::max());

  [[nodiscard]] const ChannelOptions& options() const { return options_; }
  [[nodiscard]] ChannelState state() const { return state_; }
  /// A program runs or is on hold.
  [[nodiscard]] bool active() const {
    return state_ == ChannelState::active || state_ == ChannelState::held;
  }
  /// Positions of the axes in the interpolator, also during a motion.
  [[nodiscard]] std::vector<AxisPosition> axes() const;
  /// The current state of the interpolator.
  [[nodiscard]] MotionStatus motion() const { return interpolator_.status(); }
  /// N number of the block in the interpolator (0 = none), and place of the block in the decoder.
  [[nodiscard]] long block_number() const { return interpolator_.place().block; }
  [[nodiscard]] Place decoder_place() const { return decoder_.place(); }
  /// The variables P, V.P, V.L, V.S and V.CYC; valid as long as the channel.
  [[nodiscard]] run::Memory& variables() { return memory_; }

 private:
  /// Why no program can start now.
  [[nodiscard]] std::string refusal() const;
  AbortedEvent abort(Fault fault, const Place& place);
  void stop();
  /// Runs both stages once; true if another round could make progress at this time.
  bool step(const run::Tick& tick, std::size_t& budget);

  ChannelOptions options_;
  std::shared_ptr<Timers> timers_;
  run::Memory memory_;
  run::Macros macros_;
  run::MotionState motion_;
  run::Queue queue_;
  run::MessageBox messages_;
  run::Stream stream_;
  run::Interpolator interpolator_;
  run::SystemVariables system_;
  run::Decoder decoder_;
  std::optional<long> search_;
  ChannelState state_ = ChannelState::idle;
};

/// Parses a program without running it, and returns every mistake.
std::vector<Diagnostic> check(const std::string& file, const std::string& text);

}  // namespace millrace::cnc::nc
