// Decides what an instance does with requests, withdrawals and answers. Pure: events and times in,
// actions out; no thread, no clock, no DDS.
//
//   for (const Action& action : scheduler.on_request(request, now)) …
//
// A call runs once per instance: a repeat of a running call only raises the attempt that its reply
// names, a repeat of an answered call gets the same answer from memory. The result of a handler
// whose call was cancelled is not an answer: if the call is wanted again, it runs again once the
// cancelled run has ended. An at-most-once call is answered with an error instead, unless its
// attempt is new: then an operator has decided to run it again.
//
// The times of a reply are the wall clock at the arrival of its call plus the time elapsed since:
// setting the clock during a call does not change the call's duration.
//
// A call without room is declined, so that its gateway dispatches it to another instance, unless
// the request says that no other has room: then it waits for its turn. A declined attempt stays
// declined, also if there is room later: the gateway, which may not have received the decline when
// it asked again, dispatches the call elsewhere as soon as it has.
//
// Two gateways that do not receive each other may request a channel. While both are there, each
// gets its answer; one that is gone has lost its call to the other.
//
// A call id is not secret, and a stranger may request something else under the id of another
// requester's call. So two requests are for the same call only if all their contents are the same;
// one with another text is another call, which begins when the first one has ended. Only the
// requester of a call can withdraw it, or replace it with another one. With trust, a requester is
// any participant that may speak for the machine, and an answer is remembered only for these.
// Without trust, it is one DDS writer, but an answer is remembered for every identical request: a
// restarted gateway has another writer, and its calls must not run twice.
#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "fabric/moment.hpp"
#include "fabric/request_key.hpp"
#include "services/sdk/call_memory.hpp"
#include "services/sdk/response.hpp"

namespace millrace::services::sdk {

/// How a handler ended: its response, or why there is none.
using Result = tl::expected<Response, std::string>;

/// Run the handler.
struct Start {
  fabric::Request request;
};
struct Send {
  fabric::Reply reply;
};
/// No requester waits for the answer any more: notify the handler, if it runs.
struct Cancel {
  fabric::CallId call;
  /// Its handler runs, and must be notified; false: it waited for its turn.
  bool runs = false;
};
/// The answer came after the cancellation and is not sent.
struct Drop {
  fabric::CallId call;
};
using Action = std::variant<Start, Send, Cancel, Drop>;
using Actions = std::vector<Action>;

/// Two requests are for the same call if all of this is equal. Of two calls with one id the second
/// waits for the end of the first.
struct CallKey {
  fabric::CallId call{};
  fabric::ChannelKey key{};
  /// 0 without proved requesters.
  std::uint64_t requester = 0;
  std::string uuid{};
  std::string text{};
  std::uint32_t state = 0;
  bool operator==(const CallKey&) const = default;
};

struct CallKeyHash {
  std::size_t operator()(const CallKey& key) const {
    return key.call.epoch ^ std::hash<std::uint64_t>()(key.call.number);
  }
};

struct CallSchedulerOptions {
  fabric::InstanceId instance{};
  std::size_t concurrency = 1;
  fabric::Delivery delivery = fabric::Delivery::at_least_once;
  fabric::CompletionSignal completion_signal = fabric::CompletionSignal::response_state;
  /// State of the answer that replaces a failed or invalid one.
  std::uint32_t error_state = 500;
  /// Number of stored answered calls. More than channels call at a time is enough.
  std::size_t memory = 1024;
  /// Calls that may wait for their turn.
  std::size_t most_waiting = 64;
  /// Requesters have proved their identity (fabric/dds/authenticator.hpp).
  bool authenticated_requesters = false;
};

class CallScheduler {
 public:
  explicit CallScheduler(CallSchedulerOptions options) : options_(options) {}

  /// For requests in its instance's partition.
  Actions on_request(const fabric::Request& request, fabric::Moment now);
  /// A request comes when the instance accepts none any more. It is declined, which means that it
  /// was not begun; except a call that was answered here, whose answer is repeated, and a running
  /// one.
  Actions decline(const fabric::Request& request, const fabric::Message& why);
  Actions on_withdrawn(const fabric::RequestKey& key);
  /// Continues the call, whose gateway comes back for the answer, unless another gateway has the
  /// channel now.
  Actions on_orphaned(const fabric::RequestKey& key);
  /// The response must pass check_text. It is not sent to an NC program that waits for RESPONSE,
  /// which would continue.
  Actions on_interim(fabric::CallId call, const Response& response, fabric::Moment now);
  Actions on_result(fabric::CallId call, const Result& result, fabric::Moment now);
  /// Its handler declines the attempt and has begun nothing of it.
  Actions on_declined(fabric::CallId call, const fabric::Message& why, fabric::Moment now);

  /// No call is running or waiting.
  [[nodiscard]] bool idle() const { return running_.empty() && waiting_.empty(); }
  [[nodiscard]] std::size_t running() const { return running_.size(); }
  /// Load and counters as of now.
  [[nodiscard]] fabric::InstanceStatus status() const;
  [[nodiscard]] fabric::InstanceLoad load() const;

 private:
  struct RunningCall {
    fabric::Request request;
    fabric::Moment received{};
    fabric::Time started{};
    /// The handler was notified of the cancellation: its result is not an answer any more, also if
    /// the call is wanted again.
    bool cancelled = false;
  };

  /// How a remembered call ended.
  struct AnsweredCall {
    fabric::Reply reply;
    /// It was cancelled while it ran, and may run only once; the reply says this.
    bool cancelled = false;
  };

  /// A gateway's request for a channel, as long as the request is pending or one of its calls is
  /// here.
  struct LatestRequest {
    /// The latest call, if it runs or waits here.
    std::optional<CallKey> call;
    bool orphaned = false;
  };

  [[nodiscard]] CallKey call_key_of(const fabric::Request& request) const;
  [[nodiscard]] std::optional<fabric::Message> reason_to_decline(
      const fabric::Request& request) const;
  void supersede(const fabric::Request& by, Actions& actions);
  [[nodiscard]] fabric::Reply declined_reply(const fabric::Request& request,
                                             const fabric::Message& why);
  [[nodiscard]] fabric::Reply reply_to_replaced(const CallKey& call);
  [[nodiscard]] bool has_another_gateway(const fabric::RequestKey& key) const;
  /// A present requester wants it.
  [[nodiscard]] bool is_wanted(const CallKey& call) const;
  void cancel_call(const CallKey& call, Actions& actions);
  void forget_call(const CallKey& call);
  /// The call is over: `answer` makes its reply, unless it was cancelled.
  template <typename Answer>
  Actions finish(fabric::CallId call, fabric::Moment now, Answer answer);
  fabric::Reply end(const RunningCall& call, const Result& result, fabric::SteadyTime now);
  [[nodiscard]] fabric::Reply cancelled_reply(const RunningCall& running) const;
  void cancel(RunningCall& running);
  [[nodiscard]] const AnsweredCall* answer_for(const fabric::Request& request) const;
  void repeat(const fabric::Reply& answered, const fabric::Request& request, Actions& actions);
  void start_waiting(fabric::SteadyTime now, Actions& actions);
  std::map<fabric::CallId, RunningCall>::iterator find_running(const CallKey& call);
  std::deque<RunningCall>::iterator find_waiting(const CallKey& call);

  CallSchedulerOptions options_;
  std::map<fabric::CallId, RunningCall> running_;
  /// In the order of arrival; at most one of each channel and gateway.
  std::deque<RunningCall> waiting_;
  std::map<fabric::RequestKey, LatestRequest> requests_;
  CallMemory<CallKey, AnsweredCall, CallKeyHash> answered_{options_.memory};
  /// The newest declined attempt of each call.
  CallMemory<CallKey, std::uint32_t, CallKeyHash> declined_{options_.memory};
  fabric::InstanceStatus counters_;
  std::chrono::nanoseconds handler_time_{};
};

/// Why `response` cannot be sent as a final answer to a program that waits for `completion_signal`;
/// empty if it can.
std::string check_response(const Response& response, fabric::CompletionSignal completion_signal =
                                                         fabric::CompletionSignal::response_state);
/// The same for an interim one, whose state may be 0.
std::string check_text(const std::string& text);

}  // namespace millrace::services::sdk
