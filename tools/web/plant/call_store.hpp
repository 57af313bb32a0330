// The calls of the last time, each with what is known of its way: for lists, and for the timeline
// of one of them. Pure.
//
//   if (const EndedCall* ended = store.add(entry)) …
//   store.list({.machine = "cnc", .failed = true}, 200)
//   store.timeline(call)
#pragma once

#include <cstdint>
#include <deque>
#include <list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "tools/recording/call_follower.hpp"
#include "tools/recording/timeline.hpp"

namespace millrace::tools::web::plant {

/// Which states of RESPONSE_STATE mean that a service did what it was asked for: 1 everywhere, and
/// 0 where a program waits for a text alone (docs/reference/services/README.md).
struct NormalStates {
  /// Others by canonical UUID.
  std::map<std::string, std::set<std::uint32_t>> more{};

  [[nodiscard]] bool contain(const std::string& uuid, std::uint32_t state) const;
};

struct EndedCall {
  recording::FollowedCall call{};
  /// The service failed or refused its last attempt, the program has withdrawn it, or nobody but
  /// the gateway or an operator answered.
  bool failed = false;
  /// A service answered with a state that is not among the normal ones: mostly an error of its own.
  bool other_state = false;

  /// "answered", "other_state", "failed", "withdrawn"
  [[nodiscard]] std::string_view result() const;
};

/// Letters of ASCII; others stay as they are.
std::string small_letters(std::string text);

/// An empty text, and channel 0, take everything.
struct CallFilter {
  std::string machine{};
  std::uint16_t channel = 0;
  std::string uuid{};
  std::string instance{};
  /// Both: either.
  bool failed = false;
  bool other_state = false;
  /// EndedCall::result().
  std::string result{};
  /// In request or response, in small letters of ASCII and UTF-8.
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
    /// Calls that have not ended: of programs that end while they call nobody tells the end.
    std::size_t open = 4'096;
  };

  CallStore() : CallStore(Limits{}) {}
  explicit CallStore(Limits limits, NormalStates normal = {})
      : limits_(limits), normal_(std::move(normal)) {}

  /// The call that ends with this entry; valid until the next call of add.
  const EndedCall* add(const recording::Entry& entry);

  /// Whose time has come, of those that ended or have not; without steps if it is not known.
  [[nodiscard]] recording::Timeline timeline(const fabric::CallId& call) const;
  /// As it ended; nullptr if it has not, or is not kept any more.
  [[nodiscard]] const EndedCall* ended(const fabric::CallId& call) const;
  /// At most `most`, the newest first.
  [[nodiscard]] std::vector<const EndedCall*> list(const CallFilter& filter,
                                                   std::size_t most) const;
  /// Of all that are kept the one that ended first; nullptr if none is.
  [[nodiscard]] const EndedCall* oldest() const;
  [[nodiscard]] std::size_t size() const { return ended_.size() + failed_.size(); }

  /// By channel.
  [[nodiscard]] const std::map<fabric::ChannelKey, recording::FollowedCall>& under_way() const {
    return follower_.under_way();
  }

 private:
  using Order = std::list<fabric::CallId>;
  struct Kept {
    recording::TimelineBuilder timeline;
    /// The last attempt that failed; 0 if none did.
    std::uint32_t failed_attempt = 0;
    std::optional<EndedCall> ended{};
    /// While it has not ended.
    Order::iterator place{};
  };
  struct Hash {
    std::size_t operator()(const fabric::CallId& call) const noexcept {
      return static_cast<std::size_t>(call.epoch ^ (call.number * 0x9e3779b97f4a7c15U));
    }
  };

  Kept& open(const fabric::CallId& call);
  void end(Kept& kept, recording::FollowedCall call);
  void forget_oldest();

  Limits limits_;
  NormalStates normal_;
  recording::CallFollower follower_;
  std::unordered_map<fabric::CallId, Kept, Hash> calls_;
  /// In the order of their beginning, and of their ends.
  Order open_;
  std::deque<fabric::CallId> ended_;
  std::deque<fabric::CallId> failed_;
};

}  // namespace millrace::tools::web::plant
