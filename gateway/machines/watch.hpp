// How the changes in a machine's channels are found out: told by the controller, or by looking.
// Decides when telling is asked for, when it is believed, and when it is given up. Pure.
//
//   Watch watch(WatchMode::automatic);
//   watch.serve({1, 2});                             → subscribe {1, 2}
//   watch.on_watched({{1, ""}, {2, ""}}, now);
//   watch.on_told(1, request_state, 0, now);         → look {1, request_state}
//   watch.on_looked(1, snapshot, now);               → told {1, true}: looks are for safety only
//   watch.on_told(1, request_state, 7, now);         → look {1, request_state}
//
// ADS promises no delivery, a value that changes and changes back between two samples is not told
// at all, and whether the variables of a CNC can be watched is not documented. So the silence of a
// controller is believed only while what it told last is what a read has shown last: how late a
// write of ours takes effect is not documented, so it counts when a read has shown it. Otherwise
// the channel is looked at as if nothing were told, until both agree; and if they do not come to
// agree, the controller is not believed any more.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/interest.hpp"
#include "gateway/moment.hpp"
#include "gateway/pace.hpp"
#include "gateway/snapshot.hpp"

namespace millrace::gateway::machines {

/// What became of asking a controller to tell of the changes in a channel.
struct WatchOutcome {
  std::uint16_t channel = 0;
  /// Empty: it will. Otherwise why not, in words with the code.
  std::string refusal;
  /// It did not answer the question; it may later.
  bool undecided = false;
};

/// What a watch wants done, in this order.
struct WatchActions {
  std::vector<std::uint16_t> unsubscribe{};
  std::vector<std::uint16_t> subscribe{};
  /// Whether changes in a channel are told from now on.
  std::vector<std::pair<std::uint16_t, bool>> told{};
  /// Something has changed.
  std::vector<std::pair<std::uint16_t, Variable>> look{};
  /// Lines for the log.
  std::vector<std::pair<Level, std::string>> say{};
  /// words() may be others now.
  bool status = false;
};

class Watch {
 public:
  explicit Watch(WatchMode mode) : mode_(mode) {}

  /// The channels to watch from now on; link_down() first if the link is new.
  WatchActions serve(const std::vector<std::uint16_t>& channels);
  /// Nothing is told any more, and the controller has forgotten what it was asked. A new link
  /// begins anew.
  void link_down();
  WatchActions set_mode(WatchMode mode);

  WatchActions on_watched(const std::vector<WatchOutcome>& outcomes, SteadyTime now);
  /// No value: the controller will tell no more of this variable.
  WatchActions on_told(std::uint16_t channel, Variable variable, std::optional<std::uint32_t> value,
                       SteadyTime now);
  /// A look at the channel begins. What it finds may be older than what is told before it ends.
  void looking(std::uint16_t channel);
  WatchActions on_looked(std::uint16_t channel, const Snapshot& snapshot, SteadyTime now);
  /// We have written REQUEST_STATE = 0: when a read first shows that, we have changed it and not
  /// the program.
  void on_cleared(std::uint16_t channel);
  WatchActions on_time(SteadyTime now);
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return again_; }

  /// For status and people: "pushed", "polled: the controller refuses …", "polled"; empty while
  /// there is nothing to watch.
  [[nodiscard]] std::string words() const;

  /// What is told so much later than a read has shown it is told late; a poll is faster.
  static constexpr std::chrono::milliseconds late{100};
  /// So many in a row and the controller is not believed any more: one may be ours, or the host's.
  static constexpr int most_late = 3;
  /// What was not told after so long and so many looks is not told at all. Both, since somebody may
  /// have stood still.
  static constexpr std::chrono::milliseconds lost{1000};
  static constexpr int lost_looks = 20;
  /// Changes that came and went untold, within this time, and the controller is not believed any
  /// more. One or two may have been shorter than its cycle.
  static constexpr std::size_t most_missed = 3;
  static constexpr std::chrono::minutes missed_within{10};
  /// Between two attempts where one may help.
  static constexpr std::chrono::milliseconds shortest_pause{1000};
  static constexpr std::chrono::milliseconds longest_pause{60000};

 private:
  enum class Step : std::uint8_t { idle, asked, granted, refused };

  struct ChannelWatch {
    Step step = Step::idle;
    /// REQUEST_STATE, as it was told last and as it was seen last; of RESPONSE_STATE what was seen.
    std::optional<std::uint32_t> told;
    std::optional<std::uint32_t> seen;
    std::optional<std::uint32_t> seen_response;
    /// What was seen first and was not told, and how often it was seen since.
    std::optional<SteadyTime> untold_since;
    int untold_looks = 0;
    /// REQUEST_STATE was cleared by us, and no read has shown it yet.
    bool cleared = false;
    /// Since when reads show the 0 of ours that is not told yet.
    std::optional<SteadyTime> zero_shown_at;
    /// Something else than what was told last has been seen since; and first by a look: the program
    /// has changed it, not we.
    bool other_seen = false;
    bool found_by_look = false;
    bool told_since_look = false;
    /// What the session knows.
    bool believed = false;
    std::string refusal;
  };

  void ask(WatchActions& actions);
  void see(std::uint16_t channel, std::uint32_t state, WatchActions& actions, SteadyTime now);
  /// True if that was one too many.
  bool missed(std::uint16_t channel, WatchActions& actions, SteadyTime now);
  void believe(std::uint16_t channel, ChannelWatch& one, WatchActions& actions);
  /// Not believed any more: all channels are polled.
  void give_up(const std::string& reason, WatchActions& actions, SteadyTime now);
  void reset(std::uint16_t channel, ChannelWatch& one, Step step, WatchActions& actions);
  void try_again(SteadyTime now);
  void describe(WatchActions& actions);

  WatchMode mode_;
  std::map<std::uint16_t, ChannelWatch> channels_;
  /// Why nobody is asked on this link, or not now.
  std::string given_up_;
  int times_late_ = 0;
  std::deque<SteadyTime> missed_;
  std::optional<SteadyTime> again_;
  std::chrono::milliseconds pause_ = shortest_pause;
  /// What was said last.
  std::string said_;
};

}  // namespace millrace::gateway::machines
