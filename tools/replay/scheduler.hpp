// When each call of a plan is issued. Pure: times in, calls out.
//
//   Scheduler scheduler(plan, {.timing = Timing::timed, .rate = 2});
//   while (const auto call = scheduler.next(now)) issue(plan.calls[*call]);
//   …  scheduler.ended(call, now);
//
// A channel has one call at a time, as on its controller: a call waits for the one before it in its
// channel however late that is, and the timeline does not wait for it.
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
  /// As soon as what had ended before a call in the recording has ended again: calls that ran one
  /// after the other do so, calls that ran at once may.
  fast,
  /// One after the other, each when it is allowed.
  step
};

struct Pace {
  Timing timing = Timing::timed;
  /// How many times as fast; above 0.
  double rate = 1;

  /// How long a recorded time lasts in the replay; for `fast` and `step` as long as recorded.
  [[nodiscard]] nanoseconds scaled(nanoseconds recorded) const;
};

class Scheduler {
 public:
  /// `plan` outlives the scheduler.
  Scheduler(const Plan& plan, Pace pace);

  /// The next call to issue at `now`, which counts from the start of the replay; nothing if none is
  /// due. Call it until it returns none.
  std::optional<std::size_t> next(nanoseconds now);
  /// A call that was issued is over.
  void ended(std::size_t call);
  /// For Timing::step: one more call may be issued.
  void allow() { ++allowed_; }

  /// When the next call is due that waits for its time only; nothing if none does.
  [[nodiscard]] std::optional<nanoseconds> next_time() const;
  /// When a call is to be issued by its time.
  [[nodiscard]] nanoseconds due(std::size_t call) const;
  /// The call waited for the one before it in its channel, not for its time.
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
