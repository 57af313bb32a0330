// What happened in a simulation, as an observer that sees everything records it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "fabric/messages.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/policy.hpp"
#include "gateway/service_snapshot.hpp"
#include "tests/simulation/time/agenda.hpp"

namespace millrace::tests::simulation {

using Key = fabric::ChannelKey;

/// A gateway of the simulation, counted from 0; it keeps its number across restarts.
using GatewayNumber = std::size_t;

/// The program wrote REQUEST_STATE ≠ 0, or one of its texts: from now on it waits for the answer to
/// this request.
struct ProgramAsked {
  Key key;
  gateway::PendingRequest request;
  /// A write for an earlier request has hit REQUEST_STATE, which the program has not written since.
  bool crossed = false;
};
/// It wrote something else: its previous request is not there as it was.
struct ProgramMoved {
  Key key;
  std::string why;
  /// Only the states have changed.
  bool texts_stay = true;
};
/// Its kernel clears REQUEST_STATE itself, and ignores a 0 over ADS.
struct KernelClears {
  Key key;
};
/// It wrote RESPONSE itself before its request.
struct ResponseEmptied {
  Key key;
};
/// RESPONSE_STATE released it; with the values that it read then.
struct ProgramReleased {
  Key key;
  gateway::PendingRequest request;
  /// An answer was under way to the channel when the program wrote something else.
  bool crossed = false;
  std::string text;
  std::uint32_t state = 0;
  /// It waited for RESPONSE alone: the answer may be incomplete.
  bool by_text = false;
};
/// A read of a gateway: its values, and the times of its beginning and end.
struct SnapshotRead {
  GatewayNumber gateway = 0;
  Key key;
  gateway::ServiceSnapshot snapshot;
  Time first{};
};
/// A gateway sends a write of this call's answer.
struct WriteAsked {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  gateway::Variable variable{};
  gateway::Value value;
  /// The completion signal that the gateway knows.
  fabric::CompletionSignal completion_signal{};
};
/// A gateway has the final answer of this call.
struct Answered {
  GatewayNumber gateway = 0;
  fabric::CallId call;
  gateway::Answer answer;
};
/// The write takes effect; with the state of the channel after it.
struct WriteDone {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  gateway::Variable variable{};
  /// The final answer, if this is its last write, which releases the program.
  std::optional<gateway::Answer> answer;
  gateway::Value value;
  std::string response;
  std::uint32_t request_state = 0;
  /// The program had moved on before the write took effect.
  bool crossed = false;
};
struct Claimed {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  /// The journal had reported that it cannot be written.
  bool in_trouble = false;
};
/// The gateway dispatches the call. It had dispatched `load` calls to that instance before.
struct Dispatched {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  std::uint32_t attempt = 0;
  fabric::InstanceId instance;
  fabric::Delivery delivery{};
  /// The instance is present, of this service, suitable for this channel, and not draining.
  bool ready = true;
  std::uint32_t load = 0;
  std::uint32_t room = 1;
};
/// The gateway forgets the call: answered, or because its program has moved on.
struct Ended {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  bool answered = false;
};
/// It starts and finds the call in its journal; an empty call means none.
struct Resumed {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  /// It was about to clear REQUEST_STATE, or had cleared it.
  bool clearing = false;
};
/// It receives that another gateway has this call.
struct ChannelStatusReceived {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
};
/// It leaves the channel to another gateway.
struct Refused {
  GatewayNumber gateway = 0;
  Key key;
};
/// A handler starts.
struct Started {
  fabric::InstanceId instance;
  fabric::Request request;
  fabric::Delivery delivery{};
};
struct Finished {
  fabric::InstanceId instance;
  fabric::CallId call;
};
/// The call is cancelled; its handler, if it runs, learns it.
struct Cancelled {
  fabric::InstanceId instance;
  fabric::CallId call;
};
/// An instance publishes a reply to a call.
struct Replied {
  fabric::InstanceId instance;
  fabric::Reply reply;
};
/// A gateway takes a reply from an instance's writer, with what immediately results from it.
struct ReplyReceived {
  GatewayNumber gateway = 0;
  fabric::Reply reply;
  /// The call is in its channel, unanswered, and was dispatched to this instance.
  bool completion_signal = false;
  /// The completion signal that its program waits for.
  fabric::CompletionSignal program_awaits{};
  /// The rule for refused answers, of the policy under which the call was accepted.
  std::optional<gateway::Rule> refused;
  /// The answer of the channel's call before and after.
  std::optional<gateway::Answer> before;
  std::optional<gateway::Answer> now;
  /// The gateway reports that it refuses the answer.
  bool refusal_reported = false;
};
/// A gateway publishes an event.
struct EventPublished {
  GatewayNumber gateway = 0;
  fabric::Event event;
};
/// An operator dispatches the call again.
struct Retried {
  fabric::CallId call;
};
/// This gateway starts with less than it had journalled.
struct JournalLost {
  GatewayNumber gateway = 0;
};
/// A controller has this queue.
struct QueuePlanned {
  Key key;
  /// LastGet waits for the answer.
  bool when_answered = false;
  /// Several messages have the same text.
  bool repeats = false;
};
/// A program has written a message into a queue of its controller: the `message`-th.
struct MessageWritten {
  Key key;
  std::uint64_t message = 0;
  std::uint32_t element = 0;
  std::string text;
};
/// These messages are gone, and no gateway has read them.
struct MessagesGone {
  Key key;
  std::string why;
  std::vector<std::uint64_t> messages;
};
/// A gateway has written LastGet, which covers these.
struct MessagesRead {
  GatewayNumber gateway = 0;
  Key key;
  std::vector<std::uint64_t> messages;
  /// Another client had moved LastGet since the gateway's read.
  bool crossed = false;
  /// No message is left.
  bool empty = false;
};
/// Past events of the queue can have misled a gateway, until a reader has emptied the queue.
struct OutcomeUnknown {
  Key key;
  std::string why;
};
/// A gateway has journalled a message, with its number.
struct MessageJournalled {
  GatewayNumber gateway = 0;
  Key key;
  std::uint64_t number = 0;
  std::uint32_t element = 0;
  std::string text;
};
/// A gateway has journalled that the message is answered.
struct MessageEnded {
  GatewayNumber gateway = 0;
  Key key;
  std::uint64_t number = 0;
};
/// Anything else, for the reader of a trace.
struct Note {
  std::string who;
  std::string what;
};

using Fact =
    std::variant<ProgramAsked, ProgramMoved, KernelClears, ResponseEmptied, ProgramReleased,
                 SnapshotRead, WriteAsked, Answered, WriteDone, Claimed, Dispatched, Ended, Resumed,
                 ChannelStatusReceived, Refused, Started, Finished, Cancelled, Replied,
                 ReplyReceived, EventPublished, Retried, JournalLost, QueuePlanned, MessageWritten,
                 MessagesGone, MessagesRead, OutcomeUnknown, MessageJournalled, MessageEnded, Note>;

/// The channel of a fact. Each gateway has its own channel for a message queue: "m0.q@1/1".
Key key_at(const Key& key, GatewayNumber gateway);

/// One line, without the time.
std::string to_string(const Fact& fact);

}  // namespace millrace::tests::simulation
