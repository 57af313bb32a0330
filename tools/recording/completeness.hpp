// Whether a recording has all samples of the calls that it saw: no counter shows what writers
// replace or drop before it arrives, but the samples of a call refer to each other.
//
//   Completeness completeness;
//   completeness.add(entry);                 // each entry that the bus delivers, as it comes
//   completeness.finish(now);
//   completeness.missing().incomplete        // incomplete calls
//
// Gateways number their calls without gaps, and publish each step of a call as an event: seen,
// dispatched (so there was a request), replied (so there was a reply), and written or withdrawn at
// the end. Four kinds of calls cannot be judged: those before the first received one, calls of
// tools (which are not gateways), the last ones, and numbers that a restarted gateway skips.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

struct Missing {
  /// Calls that are over and have all their samples.
  std::uint64_t complete = 0;
  /// Calls that are over and incomplete: at least the samples below are missing.
  std::uint64_t incomplete = 0;
  /// Numbers of calls of which no sample was received.
  std::uint64_t unseen = 0;
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;
  std::uint64_t events = 0;
  bool operator==(const Missing&) const = default;
};

/// Pure. The clock is the time of recording of the entries.
class Completeness {
 public:
  /// `wanted`: the recording includes it. A call counts if any of its samples is wanted.
  void add(const Entry& entry, bool wanted = true);
  /// Judges the remaining calls. The end of a call that was followed by another one a moment ago
  /// may still be on its way.
  void finish(fabric::Time now);

  [[nodiscard]] const Missing& missing() const { return missing_; }
  /// Calls that are not judged yet.
  [[nodiscard]] std::size_t open() const { return traces_.size(); }

 private:
  /// The received samples of one call.
  struct Trace {
    bool wanted = false;
    bool seen = false;
    /// Written or withdrawn, by its own event.
    bool ended = false;
    bool written = false;
    bool replied = false;
    bool refused = false;
    /// The instance whose answer it is, if a service gave it.
    std::optional<fabric::InstanceId> answered_by{};
    std::vector<std::uint32_t> dispatched{};
    std::vector<std::uint32_t> requested{};
    /// Attempts that other events name.
    std::vector<std::uint32_t> named{};
    std::vector<fabric::InstanceId> replies{};
    std::vector<std::uint32_t> interim_written{};
    std::vector<std::uint32_t> interim_replies{};
    /// When it was known to be over.
    std::optional<fabric::Time> over{};
  };
  struct Hash {
    std::size_t operator()(const fabric::CallId& call) const noexcept {
      return static_cast<std::size_t>(call.epoch ^ (call.number * 0x9e3779b97f4a7c15U));
    }
  };
  using Traces = std::unordered_map<fabric::CallId, Trace, Hash>;

  /// The calls of one journal, by one gateway process after the other.
  struct Gateway {
    /// Each process of it, and since when it is there, by its own clock.
    std::map<fabric::InstanceId, fabric::Time> processes{};
    /// The first and the last call that was seen; 0 = none.
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    fabric::Time last_at{};
    /// Calls above the last one, or in a gap, that are judged already.
    std::set<std::uint64_t> judged{};
  };
  /// Numbers between two calls that were seen.
  struct Gap {
    std::uint64_t from = 0;
    std::uint64_t to = 0;
    /// When the gateway saw the calls on both sides.
    fabric::Time before{};
    fabric::Time after{};
    fabric::Time received{};
  };

  void add_event(const fabric::Event& event, bool wanted, fabric::Time at);
  bool on_seen(const fabric::Event& event, fabric::Time at);
  void on_channel(const fabric::ChannelKey& key, const fabric::CallId& call, fabric::Time at);
  void on_status(const fabric::ChannelStatus& status, fabric::Time at);
  void on_machine(const fabric::MachineStatus& status);
  [[nodiscard]] bool is_open(const fabric::CallId& call, fabric::Time at);
  Trace& trace_of(const fabric::CallId& call, bool wanted);
  void set_over(const fabric::CallId& call, Trace& trace, fabric::Time at);
  void settle(fabric::Time until);
  void settle_gaps(fabric::Time until);
  void forget_strangers(fabric::Time until);
  void judge(Traces::iterator trace, bool at_once);
  [[nodiscard]] bool in_a_gap(const fabric::CallId& call) const;
  [[nodiscard]] std::uint64_t unseen_in(std::uint64_t epoch, const Gap& gap);

  Missing missing_;
  std::map<std::uint64_t, Gateway> gateways_;
  /// Epochs of calls, and when they were first received: a gateway publishes itself, a tool does
  /// not.
  std::deque<std::pair<fabric::Time, std::uint64_t>> strangers_;
  Traces traces_;
  /// The newest call of each channel.
  std::map<fabric::ChannelKey, fabric::CallId> current_;
  /// In the order in which they were over.
  std::deque<std::pair<fabric::Time, fabric::CallId>> over_;
  /// By the last number in them.
  std::map<fabric::CallId, Gap> gaps_;
  /// In the order in which they were received.
  std::deque<fabric::CallId> gap_order_;
};

}  // namespace millrace::tools::recording
