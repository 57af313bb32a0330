// The calls of a recording, with their times and responses, for a replay. Pure.
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
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/messages.hpp"
#include "tools/recording/call.hpp"

namespace millrace::tools::replay {

using std::chrono::nanoseconds;

/// RESPONSE and RESPONSE_STATE.
struct Answer {
  std::string text{};
  std::uint32_t state = 0;
  /// Size of the text in bytes, if the recording leaves the text out.
  std::optional<std::uint32_t> withheld{};
  bool operator==(const Answer&) const = default;
};

/// A response with its times.
struct TimedAnswer {
  Answer answer{};
  /// Since the program's request, by the recorder's clock.
  nanoseconds after{};
  /// Since the instance accepted the call, by its own clock; zero if unknown.
  nanoseconds work{};
  bool operator==(const TimedAnswer&) const = default;
};

struct PlannedCall {
  fabric::CallId recorded{};
  fabric::ChannelKey channel{};
  /// As the NC program wrote it.
  std::string uuid{};
  std::string text{};
  std::uint32_t state = 0;
  /// Time of the request, since the first call of the plan.
  nanoseconds at{};
  /// The service's interim replies.
  std::vector<TimedAnswer> interim{};
  /// The service's final reply.
  std::optional<TimedAnswer> answer{};
  /// What the program got, if it came from the gateway or an operator.
  std::optional<TimedAnswer> settled{};
  /// When the program withdrew the request.
  std::optional<nanoseconds> withdrawn_after{};

  /// End of the call, since the first call of the plan; nothing if the recording ends before.
  [[nodiscard]] std::optional<nanoseconds> end() const;
};

/// A recorded call that cannot be replayed.
struct Skipped {
  fabric::CallId recorded{};
  fabric::ChannelKey channel{};
  std::string reason{};
};

struct Plan {
  /// Ordered by time.
  std::vector<PlannedCall> calls{};
  std::vector<Skipped> skipped{};

  /// From the first to the last request.
  [[nodiscard]] nanoseconds length() const {
    return calls.empty() ? nanoseconds{} : calls.back().at;
  }
};

struct PlanOptions {
  /// Gaps between requests that are longer are cut to this; zero = no cut.
  nanoseconds max_gap{};
};

class PlanBuilder {
 public:
  /// Only requests are filtered; all entries of a matching call are taken.
  explicit PlanBuilder(recording::Filter filter = {}) : filter_(std::move(filter)) {}

  /// In the order of the file.
  void add(const recording::Entry& entry);
  [[nodiscard]] Plan build(const PlanOptions& options = {}) const;

 private:
  /// Requests, replies and events come by different DDS writers, so a reply may precede its
  /// request. If a request was answered before the recorder discovered its writer, only the
  /// gateway's events show it. Times are by the recorder's clock.
  struct Found {
    recording::Call call;
    /// Without the request: omitted or filtered out.
    std::optional<PlannedCall> planned{};
    fabric::Time asked{};
    bool withheld = false;
    /// The request itself was there, not only its event.
    bool by_request = false;
    /// The gateway took its request back.
    std::optional<fabric::Time> taken_back{};
  };

  Found& found(const fabric::CallId& call);
  void add(const fabric::Request& request, Found& found, const recording::Entry& entry);
  static PlannedCall planned(const Found& found);

  recording::Filter filter_;
  std::map<fabric::CallId, Found> found_;
};

// Maps recorded channels to live ones. Pure.
//
//   ChannelMap map;
//   map.add("cnc/1=test/7");
//   map.find({"cnc", 1})        // test/7

class ChannelMap {
 public:
  /// "cnc/1=test/7" for a channel, "cnc=test" for all channels of a machine that have no entry of
  /// their own. The error names what was expected.
  tl::expected<void, std::string> add(std::string_view text);
  /// The channel for a recorded one; nothing if there is no entry.
  [[nodiscard]] std::optional<fabric::ChannelKey> find(const fabric::ChannelKey& recorded) const;
  [[nodiscard]] bool empty() const { return channels_.empty() && machines_.empty(); }

 private:
  std::map<fabric::ChannelKey, fabric::ChannelKey> channels_;
  std::map<std::string, std::string> machines_;
};

}  // namespace millrace::tools::replay
