// What is to be replayed: the calls of a recording with their times and answers. Pure.
//
//   PlanBuilder builder(filter);
//   read_entries(source, {}, [&](const Entry& entry) { builder.add(entry); });
//   const Plan plan = builder.build({.max_gap = 5s});
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/recording/entry.hpp"
#include "tools/recording/filter.hpp"

namespace millrace::tools::replay {

using std::chrono::nanoseconds;

/// RESPONSE and RESPONSE_STATE.
struct Answer {
  std::string text{};
  std::uint32_t state = 0;
  /// The bytes its text had, if the recording leaves the text out.
  std::optional<std::uint32_t> withheld{};
  bool operator==(const Answer&) const = default;
};

/// An answer with its times.
struct TimedAnswer {
  Answer answer{};
  /// Since the program's request, by the recorder's clock.
  nanoseconds after{};
  /// Since the instance had the call, by its own clock; zero if not known.
  nanoseconds work{};
  bool operator==(const TimedAnswer&) const = default;
};

struct PlannedCall {
  fabric::CallId recorded{};
  fabric::ChannelKey channel{};
  /// As the program wrote it.
  std::string uuid{};
  std::string text{};
  std::uint32_t state = 0;
  /// When the program asked, since the first call of the plan.
  nanoseconds at{};
  /// What the service said on the way.
  std::vector<TimedAnswer> interim{};
  /// The service's final answer.
  std::optional<TimedAnswer> answer{};
  /// What was written to the program, if that came from somebody else: the gateway, an operator.
  std::optional<TimedAnswer> settled{};
  /// The program took the request back.
  std::optional<nanoseconds> withdrawn_after{};

  /// When the call was over, since the first call of the plan; nothing if the recording ends
  /// before.
  [[nodiscard]] std::optional<nanoseconds> end() const;
};

/// A recorded call that cannot be replayed.
struct Skipped {
  fabric::CallId recorded{};
  fabric::ChannelKey channel{};
  std::string reason{};
};

struct Plan {
  /// In the order of their times.
  std::vector<PlannedCall> calls{};
  std::vector<Skipped> skipped{};

  /// From the first to the last request.
  [[nodiscard]] nanoseconds length() const {
    return calls.empty() ? nanoseconds{} : calls.back().at;
  }
};

struct PlanOptions {
  /// A longer time without a request is cut to this; zero = none is.
  nanoseconds max_gap{};
};

class PlanBuilder {
 public:
  /// The filter is for requests; what belongs to a call that passes is taken wherever it stands.
  explicit PlanBuilder(recording::Filter filter = {}) : filter_(std::move(filter)) {}

  /// In the order of the file.
  void add(const recording::Entry& entry);
  [[nodiscard]] Plan build(const PlanOptions& options = {}) const;

 private:
  /// An answer and when the recorder had it.
  struct Heard {
    fabric::Time at{};
    TimedAnswer answer{};
  };

  /// Requests, replies and events come on different ways, so that a reply may stand before its
  /// request. A request that was answered before the recorder had found its writer is known by the
  /// gateway's events only. Times are by the recorder's clock.
  struct Found {
    /// Without the request: left out, or filtered out.
    std::optional<PlannedCall> call{};
    fabric::Time asked{};
    bool withheld = false;
    /// The request itself was there, not only the event.
    bool by_request = false;
    std::vector<Heard> interim{};
    std::optional<Heard> answer{};
    /// What the gateway says that the service said.
    std::optional<Heard> replied{};
    std::optional<Heard> settled{};
    std::optional<fabric::Time> withdrawn{};
    /// The gateway says that the program took it back, and does not say that it was answered.
    bool given_up = false;
  };

  void add(const fabric::Request& request, const recording::Entry& entry);
  void add(const fabric::Reply& reply, const recording::Entry& entry);
  void add(const fabric::Event& event, const recording::Entry& entry);
  static PlannedCall planned(const Found& found);

  recording::Filter filter_;
  std::map<fabric::CallId, Found> found_;
};

}  // namespace millrace::tools::replay
