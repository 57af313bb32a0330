// How changes in a machine's channels are detected: by notifications of the controller, or by
// polling. Decides when notifications are requested, trusted, and given up. Pure.
//
//   Subscriptions subscriptions(SubscriptionMode::automatic);
//   subscriptions.serve({1, 2});                               → subscribe {1, 2}
//   subscriptions.on_subscribed({{1, ""}, {2, ""}}, now);
//   subscriptions.on_notification(1, request_state, 0, now);   → changed {1, request_state}
//   subscriptions.on_read(1, snapshot, now);                   → trusted {1, true}: polled rarely
//   subscriptions.on_notification(1, request_state, 7, now);   → changed {1, request_state}
//
// ADS guarantees no delivery, a value that changes and changes back between two samples causes no
// notification, and whether the variables of a CNC can be subscribed to is not documented. So the
// silence of a controller is trusted only while its last notification has the value of the last
// read: how late a write takes effect is not documented, so a write counts when a read has shown
// it. Otherwise the channel is polled as if there were no notifications, until both agree; if they
// do not agree after a while, the controller's notifications are not used any more.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/moment.hpp"
#include "gateway/outputs.hpp"
#include "gateway/read_intervals.hpp"
#include "gateway/service_snapshot.hpp"

namespace millrace::gateway::machines {

/// The result of a subscription to the changes in a channel.
struct SubscribeOutcome {
  std::uint16_t channel = 0;
  /// Empty: granted. Otherwise the reason in words, with the code.
  fabric::Message refusal;
  /// The controller did not respond; it may later.
  bool undecided = false;
};

/// The actions of the subscriptions, in this order.
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
  /// No notifications come any more, and the controller has dropped the subscriptions. A new link
  /// starts from the beginning.
  void link_down();
  SubscriptionActions set_mode(SubscriptionMode mode);

  SubscriptionActions on_subscribed(const std::vector<SubscribeOutcome>& outcomes, SteadyTime now);
  /// No value: the controller sends no more notifications of this variable.
  SubscriptionActions on_notification(std::uint16_t channel, Variable variable,
                                      std::optional<std::uint32_t> value, SteadyTime now);
  /// A read of the channel begins. Its result may be older than a notification before its end.
  void read_started(std::uint16_t channel);
  SubscriptionActions on_read(std::uint16_t channel, const ServiceSnapshot& snapshot,
                              SteadyTime now);
  /// We have written REQUEST_STATE = 0: the first read that shows it shows our change and not the
  /// NC program's.
  void on_cleared(std::uint16_t channel);
  SubscriptionActions on_time(SteadyTime now);
  /// When on_time() has something to do.
  [[nodiscard]] std::optional<SteadyTime> next_time() const { return again_; }

  struct Status {
    /// None while there is nothing to watch.
    fabric::WatchMode mode = fabric::WatchMode::none;
    /// Why not all channels are pushed, if there is a reason: "polled: the controller refuses …".
    fabric::Message text{};
  };
  [[nodiscard]] Status status() const;

  /// A notification this long after a read showed the value is late; polling is faster.
  static constexpr std::chrono::milliseconds late{100};
  /// This number of late ones in a row ends the use of notifications: a single one may be the fault
  /// of this process or host.
  static constexpr int most_late = 3;
  /// A change that was not notified after this time and number of reads is lost. Both, since one of
  /// the two sides may have stood still.
  static constexpr std::chrono::milliseconds lost{1000};
  static constexpr int lost_reads = 20;
  /// This number of missed changes within this time ends the use of notifications. One or two may
  /// have been shorter than the controller's cycle.
  static constexpr std::size_t most_missed = 3;
  static constexpr std::chrono::minutes missed_within{10};
  /// Between two attempts, where another attempt may help.
  static constexpr std::chrono::milliseconds shortest_pause{1000};
  static constexpr std::chrono::milliseconds longest_pause{60000};

 private:
  enum class Step : std::uint8_t { idle, asked, granted, refused };

  /// A value that was read and not notified.
  struct Unnotified {
    SteadyTime since{};
    int reads = 0;
  };
  /// Whether a value other than the last notified one was read since.
  enum class Other : std::uint8_t {
    none,
    seen,
    /// First by a read: the NC program changed it, not this gateway.
    found_by_read,
  };

  /// A request for notifications, and what they have shown.
  struct Subscription {
    Step step = Step::idle;
    /// REQUEST_STATE.
    std::optional<std::uint32_t> notified{};
    bool notified_since_read = false;
    std::optional<Unnotified> unnotified{};
    /// REQUEST_STATE was cleared by us, and no read has shown it yet.
    bool cleared = false;
    /// Since when reads show our 0 that is not notified yet.
    std::optional<SteadyTime> zero_shown_at{};
    Other other = Other::none;
    fabric::Message refusal{};
  };

  struct Channel {
    /// As last read.
    std::optional<std::uint32_t> request_state;
    std::optional<std::uint32_t> response_state;
    /// The state that the channel knows.
    bool trusted = false;
    Subscription subscription;
  };

  void ask(SubscriptionActions& actions);
  void see(std::uint16_t channel, std::uint32_t state, SubscriptionActions& actions,
           SteadyTime now);
  /// True if that was one too many.
  bool missed(std::uint16_t channel, SubscriptionActions& actions, SteadyTime now);
  static void trust(std::uint16_t number, Channel& channel, SubscriptionActions& actions);
  /// Ends the use of notifications: all channels are polled.
  void give_up(const fabric::Message& reason, SubscriptionActions& actions, SteadyTime now);
  /// The next subscription begins with this step.
  static void reset(std::uint16_t number, Channel& channel, Step step,
                    SubscriptionActions& actions);
  void try_again(SteadyTime now);
  void describe(SubscriptionActions& actions);

  SubscriptionMode mode_;
  std::map<std::uint16_t, Channel> channels_;
  /// Why no notifications are requested on this link, or not now.
  fabric::Message given_up_;
  int times_late_ = 0;
  std::deque<SteadyTime> missed_;
  std::optional<SteadyTime> again_;
  std::chrono::milliseconds pause_ = shortest_pause;
  /// The last logged status.
  std::string logged_;
};

}  // namespace millrace::gateway::machines
