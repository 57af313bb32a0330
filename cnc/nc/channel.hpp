// One NC channel: a decoder that runs ahead of an interpolator, driven by ticks.
//
//   Channel channel;
//   if (auto started = channel.start("demo.nc", text); !started)
//     for (const Diagnostic& mistake : started.error()) std::cerr << mistake.to_string() << '\n';
//   while (channel.active())
//     for (const Event& event : channel.tick(now, environment)) …   // messages, saved lines, the
//     end
//
// Pure: no clock, no file, no thread. Variables, $-statements, #MSG act when the decoder reaches
// them, motion when the interpolator does; the queue between them is bounded
// (IB/tf5200_programming_manual/207042443, documented).
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/event.hpp"
#include "cnc/nc/motion.hpp"
#include "cnc/nc/timers.hpp"
#include "cnc/nc/variable_directory.hpp"

namespace millrace::cnc::nc {

struct ChannelOptions {
  /// Blocks between decoder and interpolator ("up to about 70", ISG/207421579, documented).
  std::size_t queue = 70;
  /// The last motion block waits for a following block, a flush or the end of the program. So a
  /// #WAIT FOR without #FLUSH may wait for ever (IB/tf5200_programming_manual/207058059,
  /// documented).
  bool withhold_last_motion = true;
  /// #FLUSH CONTINUE waits for the end of all motion, as a comment in the vendor's sample says
  /// (IB/tf5200_service_interface/356533387); the programming manual says that it does not
  /// (IB/tf5200_programming_manual/207042443, documented).
  bool flush_continue_waits = false;
  /// Factor on simulated motion and dwell time: 0 = they take no time, 2 = twice as long.
  double time_scale = 1.0;
  /// Of the interpolator: a motion with a message of a queue (SSDQ) takes one at least.
  std::chrono::nanoseconds cycle = std::chrono::milliseconds(1);
  /// Operations the decoder may do in one tick, so that an endless loop starves nobody.
  std::size_t decoder_budget = 200;
  /// Axes of the channel. The order is the order of Channel::axes.
  std::vector<std::string> axes = {"X", "Y", "Z"};
  /// In the order of the axes; axes beyond these go anywhere. A block that leaves them is a fault.
  std::vector<AxisLimits> limits;
  /// Speed of G00 in mm/min.
  double rapid_feed = 10'000;
  /// Somebody reads and acknowledges each message at once. Otherwise the program stops after ten
  /// unread messages, and waits for each acknowledge it asked for.
  bool messages_read_at_once = true;
  /// M01 stops.
  bool optional_stop = false;
  /// Blocks marked with / or /n are skipped if bit n-1 is set (level 1 to 10; / alone is 1).
  std::uint16_t skipped_levels = 0;
  /// The program or subprogram of this name is read from Channel::stream; none if it is empty
  /// (P-CHAN-00158, IB/tf5200_data_streaming/222568459, documented).
  std::string stream_program;
};

enum class ChannelState { idle, active, held, error };

/// Where an axis is, in mm or degrees.
struct AxisPosition {
  std::string name;
  double position = 0;
  /// At the end of the block in execution.
  double target = 0;
  /// In mm/s or degrees/s.
  double velocity = 0;
};

class Channel {
 public:
  /// Channels of one controller share their timers; without any the channel has its own.
  explicit Channel(ChannelOptions options = {}, std::shared_ptr<Timers> timers = nullptr);
  ~Channel();
  Channel(Channel&&) noexcept;
  Channel& operator=(Channel&&) noexcept;

  /// Parses and starts a main program; all its mistakes at once if it has any. Not while active.
  tl::expected<void, std::vector<Diagnostic>> start(const std::string& file,
                                                    const std::string& text);
  /// NC reset: the program ends where it is, an error is cleared, axes stay where they are. Does
  /// not help after an error that needs a restart (AbortedEvent::restart_needed): make a new
  /// channel.
  void reset();
  /// Ends the running program by an error that it did not make itself; the channel is in error
  /// until it is reset. Nothing if no program runs.
  std::optional<AbortedEvent> abort(Fault fault);
  /// Goes on after M00, M01 or a single step.
  void resume();
  /// Factor on the feed of all motions, rapid ones too (our choice); 1 is 100 %, 0 stops them.
  void set_feed_override(double factor);
  [[nodiscard]] double feed_override() const;
  void set_single_step(SingleStep step);
  [[nodiscard]] SingleStep single_step() const;
  /// Block search from the next start on: the decoder does everything as always, but nothing moves,
  /// no M function and no #MSG SYN comes, before the first block of this number; then the axes go
  /// there by rapid motion (our choice). #FLUSH WAIT before it is fault 50748
  /// (IB/tf5200_programming_manual/207042443, documented).
  void set_block_search(std::optional<long> block);
  [[nodiscard]] bool searching() const;
  /// As in the options: M01 from the next block on, the skipped levels from the next start on.
  void set_optional_stop(bool on);
  [[nodiscard]] bool optional_stop() const;
  void set_skipped_levels(std::uint16_t levels);
  [[nodiscard]] std::uint16_t skipped_levels() const;
  /// Adds a packet of whole blocks, each ended by CR and LF, to what the streaming program reads.
  /// $ statements that belong together stand in one packet (our choice). Fault 11012 if there is no
  /// room now.
  tl::expected<void, Fault> stream(std::string packet);
  /// A receiver has read the messages up to this number (MessageEvent::number).
  void read_messages(std::uint64_t number);
  /// The operator acknowledges a message; this also reads it.
  void acknowledge(std::uint64_t number);

  /// Advances decoder and interpolator to `now` (any monotonic origin). The decoder does at most
  /// `operations`, and never more than the options allow.
  std::vector<Event> tick(std::chrono::nanoseconds now, Environment& environment,
                          std::size_t operations = std::numeric_limits<std::size_t>::max());

  [[nodiscard]] const ChannelOptions& options() const;
  [[nodiscard]] ChannelState state() const;
  /// A program runs or is held.
  [[nodiscard]] bool active() const;
  /// Where the interpolator has the axes, also while they move.
  [[nodiscard]] std::vector<AxisPosition> axes() const;
  /// What the interpolator does now.
  [[nodiscard]] MotionStatus motion() const;
  /// N number of the block in the interpolator (0 = none), and of the block in the decoder.
  [[nodiscard]] long block_number() const;
  [[nodiscard]] Place decoder_place() const;
  /// The variables P, V.P, V.L, V.S and V.CYC; valid as long as the channel.
  [[nodiscard]] VariableDirectory& variables();
  [[nodiscard]] const VariableDirectory& variables() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Parses only: every mistake of a program.
std::vector<Diagnostic> check(const std::string& file, const std::string& text);

}  // namespace millrace::cnc::nc
