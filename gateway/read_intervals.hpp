// How the gateway detects changes in a channel (it polls, or the controller sends notifications),
// and what is known about how a controller applies writes.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace millrace::gateway {

/// Whether the gateway requests notifications from a controller (ADS device notifications).
enum class SubscriptionMode : std::uint8_t {
  /// Requested; polled as if not requested where the controller refuses, or its notifications are
  /// unreliable.
  automatic,
  /// The same, but requested repeatedly, at last once a minute, with a warning in the log.
  notify,
  /// Never asked.
  poll,
};

/// How often a channel is read. The defaults cost a controller 100 short reads a second for
/// each idle channel, and 100 requests a second for all of them if it knows sums.
struct ReadIntervals {
  /// Within `active_for` of an answer, when a program's next request is likely.
  std::chrono::milliseconds active{2};
  std::chrono::milliseconds active_for{1000};
  std::chrono::milliseconds idle{10};
  /// With notifications: ADS does not guarantee delivery.
  std::chrono::milliseconds subscribed{500};
  /// How often a pending request is read completely, to see texts change under the same state.
  std::chrono::milliseconds full{500};
  /// After the controller refused something or did not respond in time.
  std::chrono::milliseconds retry{500};
  /// How old a read may be when REQUEST_STATE is cleared.
  std::chrono::milliseconds max_age{10};
  /// The controller's kernel clears REQUEST_STATE itself once RESPONSE_STATE is written, and
  /// accepts no 0 from outside: none is written.
  bool kernel_clears_request_state = false;
  bool operator==(const ReadIntervals&) const = default;
};

/// What reads have shown about how one controller applies ADS writes: a later response in any
/// channel uses what an earlier one found.
struct WriteEffects {
  /// Answers whose REQUEST_STATE = 0 a read has shown, since one had to do without.
  unsigned clearings_shown = 0;
  /// Answers in a row whose 0 no read has shown before the release: the kernel clears REQUEST_STATE
  /// itself once RESPONSE_STATE is written, or the writes were lost.
  unsigned clearings_unshown = 0;
  /// The longest time lately from a write's acknowledgement to the read that showed it; 0 where the
  /// first read does.
  std::chrono::nanoseconds lag{0};

  /// An answer whose 0 a read has shown comes to its release. A program that takes its request back
  /// shows 0, too, so one answer is not proof; three are (our choice).
  void note_clearing_shown() { ++clearings_shown; }
  /// An answer is released, and no read had shown the 0.
  void note_clearing_unshown() {
    ++clearings_unshown;
    clearings_shown = 0;
  }
  /// An answer is released after a read has shown 0.
  void note_zero() { clearings_unshown = 0; }
  /// An answer is over whose 0 had to be written more than twice: what others have shown may have
  /// been NC resets, which show 0, too.
  void doubt_clearing() { clearings_shown = 0; }
  /// How often 0 is written until a read shows it (our choice). A kernel does not change, so where
  /// it was shown, one that is not is lost or late. Where it was not, the first three answers still
  /// wait for it: lost writes must not decide what kind of kernel this is.
  [[nodiscard]] unsigned most_clearings() const {
    constexpr unsigned proof = 3;
    if (clearings_unshown > 0) {
      return clearings_unshown < proof ? 1 : 0;
    }
    return clearings_shown >= proof ? 5 : 2;
  }

  /// A write was shown after this time. A single slow one is forgotten after some thirty others
  /// (our choice).
  void note_shown_after(std::chrono::nanoseconds time) { lag = std::max(time, lag - lag / 8); }
};

/// How one controller is read, and what its reads have shown.
struct ControllerReads {
  ReadIntervals intervals{};
  WriteEffects effects{};
};

}  // namespace millrace::gateway
