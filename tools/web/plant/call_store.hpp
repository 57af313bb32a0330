// The calls of the last time, each with its known steps: for lists, and for the timeline of one
// call. Pure.
//
//   if (const EndedCall* ended = store.add(entry)) …
//   store.list({.machine = "cnc", .failed = true}, 200)
//   store.timeline(call)
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "base/recent.hpp"
#include "tools/recording/timeline.hpp"

namespace millrace::tools::web::plant {

/// States of RESPONSE_STATE that mean success: 1 for all services, and 0 for programs that wait for
/// a text alone (docs/reference/services/README.md).
struct NormalStates {
  /// Further ones by canonical UUID.
  std::map<std::string, std::set<std::uint32_t>> more{};

  [[nodiscard]] bool contain(const std::string& uuid, std::uint32_t state) const;
};

struct EndedCall {
  recording::Call call{};
  /// The last one, by the name it had then.
  recording::InstanceNames::Name instance{};
  /// Its outcome is not `answered`.
  bool failed = false;
  /// The service's state is not among the normal ones: usually an error of the service.
  bool other_state = false;

  /// "answered", "other_state", "failed", "withdrawn"
  [[nodiscard]] std::string_view result() const;
};

/// An empty text and channel 0 match everything.
struct CallFilter {
  std::string machine{};
  std::uint16_t channel = 0;
  std::string uuid{};
  std::string instance{};
  /// With both flags, either matches.
  bool failed = false;
  bool other_state = false;
  /// EndedCall::result().
  std::string result{};
  /// Part of request or response, in UTF-8 with small ASCII letters.
  std::string text{};

  [[nodiscard]] bool takes(const EndedCall& call) const;
};

class CallStore {
 public:
  struct Limits {
    /// The last calls that ended.
    std::size_t ended = 10'000;
    /// Those among the older ones that failed, or were answered with another state.
    std::size_t failed = 1'000;
    /// Calls that have not ended: if a program ends during its call, no end is published.
    std::size_t open = 4'096;
  };

  CallStore() : CallStore(Limits{}) {}
  explicit CallStore(Limits limits, NormalStates normal = {})
      : limits_(limits), normal_(std::move(normal)), open_(limits.open) {}

  /// The call that ends with this entry; valid until the next call of add.
  const EndedCall* add(const recording::Entry& entry);

  /// Also of a call that has not ended; without steps if the call is unknown.
  [[nodiscard]] recording::Timeline timeline(const fabric::CallId& call) const;
  /// The call as it ended; nullptr if it has not, or is not kept any more.
  [[nodiscard]] const EndedCall* ended(const fabric::CallId& call) const;
  /// At most `most`, the newest first.
  [[nodiscard]] std::vector<const EndedCall*> list(const CallFilter& filter,
                                                   std::size_t most) const;
  /// The kept call that ended first; nullptr if there is none.
  [[nodiscard]] const EndedCall* oldest() const;
  [[nodiscard]] std::size_t size() const { return ended_.size() + failed_.size(); }

  /// The call of the channel that is under way; nullptr if none is known.
  [[nodiscard]] const recording::Call* under_way(const fabric::ChannelKey& key) const;

 private:
  struct Kept {
    EndedCall call;
    bool ended = false;
  };
  struct Hash {
    std::size_t operator()(const fabric::CallId& call) const noexcept {
      return static_cast<std::size_t>(call.epoch ^ (call.number * 0x9e3779b97f4a7c15U));
    }
  };

  Kept& open(const fabric::CallId& call);
  void judge(EndedCall& call) const;
  void forget_oldest();

  Limits limits_;
  NormalStates normal_;
  recording::InstanceNames names_;
  std::map<fabric::ChannelKey, fabric::CallId> under_way_;
  std::unordered_map<fabric::CallId, Kept, Hash> calls_;
  /// Ordered by begin, and by end.
  base::Recent<fabric::CallId, std::monostate, Hash> open_;
  std::deque<fabric::CallId> ended_;
  std::deque<fabric::CallId> failed_;
};

}  // namespace millrace::tools::web::plant
