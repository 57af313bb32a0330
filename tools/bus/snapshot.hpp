// Joins a fabric, listens until no new process comes (ListeningTime), and leaves; or stays.
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <set>
#include <string>

#include "fabric/dds/participant.hpp"
#include "fabric/observer/observer.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::tools::bus {

// How long a command listens to a fabric until all processes on it have announced themselves. Pure.

struct Patience {
  /// The shortest time. On a host that is not busy all processes have announced themselves by then.
  std::chrono::milliseconds at_least{700};
  /// Listens on until no new process came for this long.
  std::chrono::milliseconds quiet{200};
  std::chrono::milliseconds at_most{10000};
  /// With trust: the longest wait for announced participants to be authenticated. A participant of
  /// another plant never is.
  std::chrono::milliseconds authentication{3000};
};

/// At least `time`, and as much longer as a busy host may need.
Patience patience_of(std::chrono::nanoseconds time);

/// Ends after Patience::at_most at the latest. A late timer starts Patience::at_least and
/// Patience::authentication again.
class ListeningTime {
 public:
  using Clock = std::chrono::steady_clock;

  /// A timer that fires later than this shows that the host is busy. Discovery is late then, too
  /// (our choice).
  static constexpr std::chrono::milliseconds most_late{20};
  /// The longest time between two timers, so that a busy host is noticed.
  static constexpr std::chrono::milliseconds look_again{50};

  ListeningTime(Patience patience, Clock::time_point start)
      : patience_(patience),
        start_(start),
        authentication_until_(start + patience.authentication),
        until_(start + patience.at_least) {}

  /// A new process announced itself.
  void on_news(Clock::time_point now) { until_ = std::max(until_, now + patience_.quiet); }
  /// A timer of this process was due at `due` and fired at `now`.
  void on_timer(Clock::time_point due, Clock::time_point now) {
    if (now - due > most_late) {
      until_ = std::max(until_, now + patience_.at_least);
      authentication_until_ = now + patience_.authentication;
    }
  }
  /// `unauthenticated` while an announced participant is not authenticated.
  [[nodiscard]] Clock::time_point end(bool unauthenticated = false) const {
    return std::min(unauthenticated ? std::max(until_, authentication_until_) : until_,
                    start_ + patience_.at_most);
  }

 private:
  Patience patience_;
  Clock::time_point start_;
  Clock::time_point authentication_until_;
  Clock::time_point until_;
};

/// No further process is expected: the time is over, also that of announced participants which are
/// not authenticated. Their endpoints come a little later, so each is news. Throws
/// std::runtime_error with Cyclone's reason.
bool is_over(ListeningTime& time, ListeningTime::Clock::time_point now,
             const fabric::dds::Participant& participant);

/// The names of the fabrics, but for that of `participant`, in which processes of its domain have
/// endpoints now. With trust: authenticated processes. At most 16: a stranger can announce any
/// number. Throws std::runtime_error with Cyclone's reason.
std::set<std::string> other_fabrics(const fabric::dds::Participant& participant);

/// Ends sooner once `enough` returns true, which is called after each change. Throws
/// std::runtime_error if the fabric cannot be joined.
fabric::plant::Plant take_snapshot(
    const fabric::dds::ParticipantOptions& options, Patience patience = {},
    const std::function<bool(const fabric::plant::Plant&)>& enough = nullptr);

/// Hands out each entry until no new process comes. Throws as take_snapshot().
void listen(const fabric::dds::ParticipantOptions& options, Patience patience,
            fabric::observer::Interest interest,
            const std::function<void(const fabric::observer::Entry&)>& on_entry);

/// Calls `draw` once no new process comes, and then every `period`, until it returns false, or
/// SIGINT or SIGTERM. Throws as take_snapshot().
void watch(const fabric::dds::ParticipantOptions& options, Patience patience,
           std::chrono::milliseconds period,
           const std::function<bool(const fabric::plant::Plant&)>& draw);

}  // namespace millrace::tools::bus
