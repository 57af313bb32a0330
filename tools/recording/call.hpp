// What is known of one call: every step that the gateway and the instances published.
//
//   Call call(id);
//   call.add(entry);                         // any entry, in any order
//   call.outcome() == Outcome::answered
//
// Lists, timelines, durations, metrics and replay plans read a call here, so they agree on what it
// was.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/recent.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// In the order a call takes them.
enum class Stage : std::uint8_t {
  seen,
  unserved,
  dispatched,
  received,
  started,
  /// The instance has published an interim reply.
  interim_reply,
  /// The gateway has written it.
  interim,
  answered,
  declined,
  replied,
  refused,
  lost,
  held,
  late,
  withdrawn,
  written,
};

/// "seen by the gateway", …
std::string_view name_of(Stage stage);
/// Of the gateway's event: "seen", "dispatched", …; empty for a step of the instance.
std::string_view event_name_of(Stage stage);

struct Step {
  Stage stage = Stage::seen;
  /// By the clock of its publisher; zero if that gives none.
  fabric::Time at{};
  /// When the observer received it.
  fabric::Time received{};
  std::uint32_t attempt = 0;
  /// By the clock of the service's host rather than the gateway's.
  bool by_service = false;
  /// The instance it concerns, or all zero.
  fabric::InstanceId instance{};
  /// A reply that is an error, or an attempt that ended without a response (is_failure() of its
  /// entry).
  bool failure = false;
  /// Of a reply.
  fabric::ServiceCode code = fabric::ServiceCode::ok;
  /// Request or response text, if there is one.
  std::string text{};
  std::optional<std::uint32_t> withheld{};
  std::uint32_t state = 0;
  fabric::Message detail{};
};

enum class Outcome : std::uint8_t {
  under_way,
  /// By a service, whatever happened to earlier attempts.
  answered,
  /// The response is an error: of a service that failed, or of the gateway in place of a response
  /// that it refused.
  failed,
  /// The response came from the gateway or an operator.
  settled,
  /// By the NC program.
  withdrawn,
};

/// "under way", "answered", …
std::string_view name_of(Outcome outcome);

struct Call {
  enum class Texts : std::uint8_t { kept, left_out };

  Call() = default;
  explicit Call(fabric::CallId call, Texts wanted = Texts::kept) : id(call), texts(wanted) {}

  /// False for an entry that is not of this call, or shows no step.
  bool add(const Entry& entry);

  /// As they were received, each once. nullptr if there is none.
  [[nodiscard]] const Step* first(Stage stage) const;
  [[nodiscard]] const Step* last(Stage stage) const;
  /// The same of one attempt.
  [[nodiscard]] const Step* of_attempt(Stage stage, std::uint32_t attempt) const;
  /// Written or withdrawn; nullptr while it is under way. A gateway that resumes may repeat it.
  [[nodiscard]] const Step* end() const;
  /// The newest step of the gateway that concerns an attempt; nullptr if it is not dispatched.
  [[nodiscard]] const Step* newest() const;
  [[nodiscard]] Outcome outcome() const;
  /// The newest that its instance was given, if its service does not count attempts (0).
  [[nodiscard]] std::uint32_t attempt_of(const Step& step) const;
  /// From seen to its end; none unless both are known.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> duration() const;

  [[nodiscard]] std::uint32_t attempt() const {
    return newest() == nullptr ? 0 : newest()->attempt;
  }
  [[nodiscard]] fabric::InstanceId instance() const {
    return newest() == nullptr ? fabric::InstanceId{} : newest()->instance;
  }

  fabric::CallId id{};
  Texts texts = Texts::kept;
  fabric::ChannelKey key{};
  /// Canonical.
  std::string uuid{};
  bool replayed = false;
  std::vector<Step> steps{};

 private:
  /// No instance has published the response that was written, but as an error.
  [[nodiscard]] bool is_error(const Step& written) const;
  void add(const fabric::Request& request, const Entry& entry);
  void add(const fabric::Reply& reply, const Entry& entry);
  void add(const fabric::Event& event, const Entry& entry);
  void add(Step step);
};

/// Name and host of each instance that was discovered. Also of those that are gone: their last
/// calls may end later.
class InstanceNames {
 public:
  struct Name {
    std::string name{};
    std::string host{};
  };

  void add(const Entry& entry);
  /// Empty if discovery has not shown it.
  [[nodiscard]] Name of(const fabric::InstanceId& instance) const;

 private:
  std::map<fabric::InstanceId, Name> names_;
};

/// The calls of each channel that are under way. Takes entries in the order in which they were
/// received.
class CallFollower {
 public:
  /// The call that ends with this entry.
  std::optional<Call> add(const Entry& entry);

  [[nodiscard]] const std::map<fabric::ChannelKey, Call>& under_way() const { return under_way_; }

 private:
  std::map<fabric::ChannelKey, Call> under_way_;
};

/// Collects calls whose samples come from several writers and may be recorded out of order. A call
/// is complete when it has ended and, if an instance has answered it, that sample is known too.
class CallCollector {
 public:
  explicit CallCollector(Call::Texts texts) : texts_(texts) {}

  /// The calls that are complete with this entry, and one that never was: at most 4,096 are open.
  std::vector<Call> add(const Entry& entry);
  /// The other calls, in the order of their first entries. Call it at the end.
  std::vector<Call> close();

 private:
  /// More than all channels have running; older ones wait for samples that were lost.
  static constexpr std::size_t most_open = 4096;

  Call::Texts texts_;
  base::Recent<fabric::CallId, Call> open_{most_open};
  /// A gateway that resumes repeats the last step of a call.
  base::Recent<fabric::CallId> closed_{most_open};
};

}  // namespace millrace::tools::recording
