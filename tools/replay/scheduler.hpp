// When each call of a plan is issued. Pure: times in, calls out.
//
//   Scheduler scheduler(plan, {.timing = Timing::timed, .rate = 2});
//   while (const auto call = scheduler.next(now)) issue(plan.calls[*call]);
//   …  scheduler.ended(call, now);
//
// A channel has one call at a time, as on its controller: a call waits for its predecessor in the
// channel, however late that ends. The timeline of the other channels does not wait.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "tools/replay/plan.hpp"

namespace millrace::tools::replay {

enum class Timing : std::uint8_t {
  /// At the recorded times.
  timed,
  /// A call is issued as soon as the calls that had ended before it in the recording have ended:
  /// sequential calls stay sequential, concurrent ones may be concurrent.
  fast,
  /// One at a time, each after allow().
  step
};

struct Pace {
  Timing timing = Timing::timed;
  /// Speed factor; above 0.
  double rate = 1;

  /// Length of a recorded duration in the replay; unchanged for `fast` and `step`.
  [[nodiscard]] nanoseconds scaled(nanoseconds recorded) const;
};

class Scheduler {
 public:
  /// `plan` outlives the scheduler.
  Scheduler(const Plan& plan, Pace pace);

  /// The next call to issue at `now` (since the start of the replay); nothing if none is due. Call
  /// it until it returns nothing.
  std::optional<std::size_t> next(nanoseconds now);
  /// A call that was issued is over.
  void ended(std::size_t call);
  /// For Timing::step: one more call may be issued.
  void allow() { ++allowed_; }

  /// Due time of the next call that waits only for its time; nothing if there is none.
  [[nodiscard]] std::optional<nanoseconds> next_time() const;
  /// Due time of a call.
  [[nodiscard]] nanoseconds due(std::size_t call) const;
  /// The call waited for its predecessor in its channel, not for its time.
  [[nodiscard]] bool was_held_up(std::size_t call) const { return held_up_.contains(call); }

  /// Every call has been issued and is over.
  [[nodiscard]] bool done() const { return issued_ == plan_.calls.size() && open_.empty(); }
  [[nodiscard]] std::size_t issued() const { return issued_; }

 private:
  struct ChannelCalls {
    std::deque<std::size_t> waiting;
    bool busy = false;
  };

  std::optional<std::size_t> next_timed(nanoseconds now);
  std::optional<std::size_t> next_in_order();
  [[nodiscard]] bool must_wait(const PlannedCall& call) const;
  std::size_t issue(std::size_t call);

  const Plan& plan_;
  Pace pace_;
  std::map<fabric::ChannelKey, ChannelCalls> channels_;
  std::set<std::size_t> open_;
  std::set<std::size_t> held_up_;
  std::size_t issued_ = 0;
  std::size_t allowed_ = 0;
};

}  // namespace millrace::tools::replay
