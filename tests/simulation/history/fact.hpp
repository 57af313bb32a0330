// What happened in a simulation, as somebody sees it who sees everything.
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

/// A gateway of the simulation, counted from 0; it keeps its number when it starts again.
using GatewayNumber = std::size_t;

/// The program wrote REQUEST_STATE ≠ 0, or a text beside it: from now on it waits for an answer to
/// this.
struct ProgramAsked {
  Key key;
  gateway::PendingRequest request;
  /// What was meant for an earlier request has met REQUEST_STATE, which it has not written since.
  bool crossed = false;
};
/// It wrote something else: what it asked before stands no more as it was.
struct ProgramMoved {
  Key key;
  std::string why;
  /// Nothing but the states changed.
  bool texts_stay = true;
};
/// Its kernel clears REQUEST_STATE itself, and takes no 0 from outside.
struct KernelClears {
  Key key;
};
/// It wrote RESPONSE itself, before it asks.
struct ResponseEmptied {
  Key key;
};
/// RESPONSE_STATE let it go on; this is what it read then.
struct ProgramReleased {
  Key key;
  gateway::PendingRequest request;
  /// An answer was on its way to the channel when the program asked something else.
  bool crossed = false;
  std::string text;
  std::uint32_t state = 0;
  /// It waited for RESPONSE alone: the answer may not be complete.
  bool by_text = false;
};
/// A look of a gateway: what it read, and between which times.
struct Looked {
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
  /// What the program waits for, as the gateway knows.
  fabric::CompletionSignal completion_signal{};
};
/// A gateway has the final answer of this call.
struct Answered {
  GatewayNumber gateway = 0;
  fabric::CallId call;
};
/// It takes place; the channel as it is then.
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
  /// The program had moved on by itself before it took effect.
  bool crossed = false;
};
struct Claimed {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  /// The journal had said that it cannot be written.
  bool in_trouble = false;
};
/// The gateway decides who gets the call. `load` calls it had given to that instance before.
struct GivenOut {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  std::uint32_t attempt = 0;
  fabric::InstanceId instance;
  fabric::Delivery delivery{};
  /// The instance is there, of this service, for this channel, and not draining.
  bool ready = true;
  std::uint32_t load = 0;
  std::uint32_t room = 1;
};
/// The gateway forgets the call; answered, or because its program has moved on.
struct Ended {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  bool answered = false;
};
/// It starts and finds the call in its journal; an empty call stands for none.
struct Resumed {
  GatewayNumber gateway = 0;
  Key key;
  fabric::CallId call;
  gateway::PendingRequest request;
  /// It had been about to clear REQUEST_STATE, or had done so.
  bool clearing = false;
};
/// It hears that another gateway has this call.
struct Heard {
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
/// Its handler, if it runs, is told that nobody waits.
struct Cancelled {
  fabric::InstanceId instance;
  fabric::CallId call;
};
/// An instance says something of a call.
struct Replied {
  fabric::InstanceId instance;
  fabric::Reply reply;
};
/// A gateway takes what the writer of an instance has said, and what comes of it at once.
struct ReplyTaken {
  GatewayNumber gateway = 0;
  fabric::Reply reply;
  /// The call stands in its channel, unanswered, and was given to this instance.
  bool completion_signal = false;
  /// What its program waits for.
  fabric::CompletionSignal program_awaits{};
  /// Of the policy under which the call was accepted.
  std::optional<gateway::Rule> refused;
  /// What the call in the channel was answered with before, and is now.
  std::optional<gateway::Answer> before;
  std::optional<gateway::Answer> now;
  /// The gateway says that it refuses it.
  bool refusal_told = false;
};
/// An operator has the call given out again.
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
/// These stand there no more, and it was no gateway.
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
  /// Somebody else had moved LastGet since the gateway looked.
  bool crossed = false;
  /// None is left.
  bool empty = false;
};
/// What has happened in the queue until now can have misled a gateway, until somebody has read it
/// to its end.
struct NobodyCanTell {
  Key key;
  std::string why;
};
/// A gateway has a message journalled, under its number.
struct MessageTaken {
  GatewayNumber gateway = 0;
  Key key;
  std::uint64_t number = 0;
  std::uint32_t element = 0;
  std::string text;
};
/// … and that it is answered.
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
    std::variant<ProgramAsked, ProgramMoved, KernelClears, ResponseEmptied, ProgramReleased, Looked,
                 WriteAsked, Answered, WriteDone, Claimed, GivenOut, Ended, Resumed, Heard, Refused,
                 Started, Finished, Cancelled, Replied, ReplyTaken, Retried, JournalLost,
                 QueuePlanned, MessageWritten, MessagesGone, MessagesRead, NobodyCanTell,
                 MessageTaken, MessageEnded, Note>;

/// What is said of a channel. Each gateway plays one of its own for a message queue: "m0.q@1/1".
Key key_at(const Key& key, GatewayNumber gateway);

/// One line, without the time.
std::string to_string(const Fact& fact);

}  // namespace millrace::tests::simulation
