// How the changes in a machine's channels are found out: by notifications of the controller, or by
// reading. Decides when notifications are asked for, when they are trusted, and when they are given
// up. Pure.
//
//   Subscriptions subscriptions(SubscriptionMode::automatic);
//   subscriptions.serve({1, 2});                               → subscribe {1, 2}
//   subscriptions.on_subscribed({{1, ""}, {2, ""}}, now);
//   subscriptions.on_notification(1, request_state, 0, now);   → changed {1, request_state}
//   subscriptions.on_read(1, snapshot, now);                   → trusted {1, true}: polled rarely
//   subscriptions.on_notification(1, request_state, 7, now);   → changed {1, request_state}
//
// ADS promises no delivery, a value that changes and changes back between two samples gives no
// notification at all, and whether the variables of a CNC can be subscribed to is not documented.
// So the silence of a controller is trusted only while its last notification has the value that the
// last read has shown: how late a write of ours takes effect is not documented, so it counts when a
// read has shown it. Otherwise the channel is read as if there were no notifications, until both
// agree; and if they do not come to agree, the controller is not trusted any more.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "gateway/moment.hpp"
#include "gateway/read_intervals.hpp"
#include "gateway/readers.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::machines {

/// What became of asking a controller for notifications of the changes in a channel.
struct SubscribeOutcome {
  std::uint16_t channel = 0;
  /// Empty: it will. Otherwise why not, in words with the code.
  std::string refusal;
  /// It did not answer the question; it may later.
  bool undecided = false;
};

/// What the subscriptions want done, in this order.
struct SubscriptionActions {
  std::vector<std::uint16_t> unsubscribe{};
  std::vector<std::uint16_t> subscribe{};
  /// Whether the notifications of a channel are trusted from now on.
  std::vector<std::pair<std::uint16_t, bool>> trusted{};
  /// Something has changed.
  std::vector<std::pair<std::uint16_t, Variable>> changed{};
  /// Lines for the log.
  std::vector<std::pair<Level, std::string>> log{};
  /// status_text() may be others now.
  bool status = false;
};

class Subscriptions {
 public:
  explicit Subscriptions(SubscriptionMode mode) : mode_(mode) {}

  /// The channels to subscribe to from now on; link_down() first if the link is new.
  SubscriptionActions serve(const std::vector<std::uint16_t>& channels);
  /// Nothing is told any more, and the controller has forgotten what it was asked. A new link
  /// begins anew.
  void link_down();
  SubscriptionActions set_mode(SubscriptionMode mode);

  SubscriptionActions on_subscribed(const std::vector<SubscribeOutcome>& outcomes, SteadyTime now);
  /// No value: the controller will tell no more of this variable.
  SubscriptionActions on_notification(std::uint16_t channel, Variable variable,
                                      std::optional<std::uint32_t> value, SteadyTime now);
  /// A read of the channel begins. What it finds may be older than a notification before its end.
  void read_started(std::uint16_t channel);
  SubscriptionActions on_read(std::uint16_t channel, const ServiceSnapshot& snapshot,
                              SteadyTime now);
  /// We have written REQUEST_STATE = 0: when a read first shows that, we have changed it and not
  /// the program.
  void on_cleared(std::uint16_t channel);
  SubscriptionActions on_time(SteadyTime now);
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return again_; }

  /// For status and people: "pushed", "polled: the controller refuses …", "polled"; empty while
  /// there is nothing to watch.
  [[nodiscard]] std::string status_text() const;

  /// What is told so much later than a read has shown it is told late; a poll is faster.
  static constexpr std::chrono::milliseconds late{100};
  /// So many in a row and the controller is not believed any more: one may be ours, or the host's.
  static constexpr int most_late = 3;
  /// What was not told after so long and so many reads is not told at all. Both, since somebody may
  /// have stood still.
  static constexpr std::chrono::milliseconds lost{1000};
  static constexpr int lost_reads = 20;
  /// Changes that came and went untold, within this time, and the controller is not believed any
  /// more. One or two may have been shorter than its cycle.
  static constexpr std::size_t most_missed = 3;
  static constexpr std::chrono::minutes missed_within{10};
  /// Between two attempts where one may help.
  static constexpr std::chrono::milliseconds shortest_pause{1000};
  static constexpr std::chrono::milliseconds longest_pause{60000};

 private:
  enum class Step : std::uint8_t { idle, asked, granted, refused };

  struct ChannelSubscription {
    Step step = Step::idle;
    /// REQUEST_STATE, as it was told last and as it was seen last; of RESPONSE_STATE what was seen.
    std::optional<std::uint32_t> notified;
    std::optional<std::uint32_t> seen;
    std::optional<std::uint32_t> seen_response;
    /// What was seen first and was not told, and how often it was seen since.
    std::optional<SteadyTime> unnotified_since;
    int unnotified_reads = 0;
    /// REQUEST_STATE was cleared by us, and no read has shown it yet.
    bool cleared = false;
    /// Since when reads show the 0 of ours that is not told yet.
    std::optional<SteadyTime> zero_shown_at;
    /// Something else than what was told last has been seen since; and first by a read: the program
    /// has changed it, not we.
    bool other_seen = false;
    bool found_by_read = false;
    bool notified_since_read = false;
    /// What the channel knows.
    bool trusted = false;
    std::string refusal;
  };

  void ask(SubscriptionActions& actions);
  void see(std::uint16_t channel, std::uint32_t state, SubscriptionActions& actions,
           SteadyTime now);
  /// True if that was one too many.
  bool missed(std::uint16_t channel, SubscriptionActions& actions, SteadyTime now);
  void trust(std::uint16_t channel, ChannelSubscription& one, SubscriptionActions& actions);
  /// Not believed any more: all channels are polled.
  void give_up(const std::string& reason, SubscriptionActions& actions, SteadyTime now);
  void reset(std::uint16_t channel, ChannelSubscription& one, Step step,
             SubscriptionActions& actions);
  void try_again(SteadyTime now);
  void describe(SubscriptionActions& actions);

  SubscriptionMode mode_;
  std::map<std::uint16_t, ChannelSubscription> channels_;
  /// Why nobody is asked on this link, or not now.
  std::string given_up_;
  int times_late_ = 0;
  std::deque<SteadyTime> missed_;
  std::optional<SteadyTime> again_;
  std::chrono::milliseconds pause_ = shortest_pause;
  /// What was said last.
  std::string logged_status_;
};

}  // namespace millrace::gateway::machines
