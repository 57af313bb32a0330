#include "tests/simulation/history/fact.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"
#include "gateway/text.hpp"

namespace millrace::tests::simulation {

namespace {

std::string text_of(const gateway::Value& value) {
  const auto* state = std::get_if<std::uint32_t>(&value);
  return state != nullptr ? std::to_string(*state)
                          : fmt::format("\"{}\"", gateway::printable(std::get<std::string>(value)));
}

std::string text_of(const gateway::PendingRequest& request) {
  return fmt::format("{:.8} \"{}\" state {}", request.uuid, request.text, request.state);
}

std::string text_of(const fabric::Reply& reply) {
  return fmt::format("{}\"{}\" state {} to {}",
                     reply.kind == fabric::ReplyKind::interim    ? "interim "
                     : reply.kind == fabric::ReplyKind::declined ? "declines "
                                                                 : "",
                     gateway::printable(reply.text), reply.state, reply.call.to_string());
}

std::string text_of(const gateway::ServiceSnapshot& snapshot) {
  std::string words;
  const auto add = [&](gateway::Variable variable, const gateway::Value& value) {
    if (snapshot.has(variable)) {
      words += fmt::format(" {}={}", name_of(variable).substr(12), text_of(value));
    }
  };
  using enum gateway::Variable;
  add(uuid, snapshot.uuid.substr(0, 8));
  add(request, snapshot.request);
  add(request_state, snapshot.request_state);
  add(response_state, snapshot.response_state);
  add(response, snapshot.response);
  return words;
}

std::string short_of(const fabric::InstanceId& instance) {
  return instance.to_string().substr(0, 8);
}

struct Words {
  std::string operator()(const ProgramAsked& program_asked) const {
    return fmt::format("{}  program asks {}", program_asked.key.to_string(),
                       text_of(program_asked.request));
  }
  std::string operator()(const ProgramMoved& program_moved) const {
    return fmt::format("{}  {}", program_moved.key.to_string(), program_moved.why);
  }
  std::string operator()(const KernelClears& kernel_clears) const {
    return fmt::format("{}  kernel clears REQUEST_STATE itself", kernel_clears.key.to_string());
  }
  std::string operator()(const ResponseEmptied& response_emptied) const {
    return fmt::format("{}  program empties RESPONSE", response_emptied.key.to_string());
  }
  std::string operator()(const ProgramReleased& program_released) const {
    return fmt::format("{}  program continues with state {}, \"{}\"",
                       program_released.key.to_string(), program_released.state,
                       gateway::printable(program_released.text));
  }
  std::string operator()(const SnapshotRead& read) const {
    return fmt::format("{}  gateway {} read:{}", read.key.to_string(), read.gateway,
                       text_of(read.snapshot));
  }
  std::string operator()(const WriteAsked& write) const {
    return fmt::format("{}  gateway {} sends {} for {}", write.key.to_string(), write.gateway,
                       name_of(write.variable).substr(12), write.call.to_string());
  }
  std::string operator()(const Answered& answered) const {
    return fmt::format("gateway {} has the answer of {}", answered.gateway,
                       answered.call.to_string());
  }
  std::string operator()(const WriteDone& write) const {
    return fmt::format("{}  {} = {} by gateway {} for {}", write.key.to_string(),
                       name_of(write.variable).substr(12), text_of(write.value), write.gateway,
                       write.call.to_string());
  }
  std::string operator()(const Claimed& claimed) const {
    return fmt::format("{}  gateway {} accepts {} as {}", claimed.key.to_string(), claimed.gateway,
                       text_of(claimed.request), claimed.call.to_string());
  }
  std::string operator()(const Dispatched& dispatched) const {
    return fmt::format("{}  gateway {} dispatches {} to {}, attempt {}", dispatched.key.to_string(),
                       dispatched.gateway, dispatched.call.to_string(),
                       short_of(dispatched.instance), dispatched.attempt);
  }
  std::string operator()(const Ended& ended) const {
    return fmt::format("{}  gateway {}: {} is over{}", ended.key.to_string(), ended.gateway,
                       ended.call.to_string(), ended.answered ? "" : ", unanswered");
  }
  std::string operator()(const Resumed& resumed) const {
    return fmt::format("{}  gateway {} finds {} in its journal", resumed.key.to_string(),
                       resumed.gateway, resumed.call.to_string());
  }
  std::string operator()(const ChannelStatusReceived& fact) const {
    return fmt::format("{}  gateway {} hears of {}", fact.key.to_string(), fact.gateway,
                       fact.call.to_string());
  }
  std::string operator()(const Refused& refused) const {
    return fmt::format("{}  gateway {} leaves it to another one", refused.key.to_string(),
                       refused.gateway);
  }
  std::string operator()(const Started& started) const {
    return fmt::format("{}  instance {} starts {}, attempt {}", started.request.key.to_string(),
                       short_of(started.instance), started.request.call.to_string(),
                       started.request.attempt);
  }
  std::string operator()(const Finished& finished) const {
    return fmt::format("instance {} has finished {}", short_of(finished.instance),
                       finished.call.to_string());
  }
  std::string operator()(const Cancelled& cancelled) const {
    return fmt::format("instance {} gets a cancellation of {}", short_of(cancelled.instance),
                       cancelled.call.to_string());
  }
  std::string operator()(const Replied& replied) const {
    return fmt::format("{}  instance {} replies {}", replied.reply.key.to_string(),
                       short_of(replied.instance), text_of(replied.reply));
  }
  std::string operator()(const ReplyReceived& reply_received) const {
    return fmt::format("{}  gateway {} takes {}{}", reply_received.reply.key.to_string(),
                       reply_received.gateway, text_of(reply_received.reply),
                       reply_received.refusal_reported ? " and refuses it" : "");
  }
  std::string operator()(const EventPublished& event_published) const {
    return fmt::format("{}  gateway {} publishes {} of {}, attempt {}",
                       event_published.event.key.to_string(), event_published.gateway,
                       fabric::name_of(event_published.event.kind),
                       event_published.event.call.to_string(), event_published.event.attempt);
  }
  std::string operator()(const Retried& retried) const {
    return fmt::format("operator: retry {}", retried.call.to_string());
  }
  std::string operator()(const JournalLost& journal_lost) const {
    return fmt::format("gateway {} has lost the end of its journal", journal_lost.gateway);
  }
  std::string operator()(const QueuePlanned& queue_planned) const {
    return fmt::format("{}  is a message queue{}{}", queue_planned.key.to_string(),
                       queue_planned.when_answered ? ", drained when answered" : "",
                       queue_planned.repeats ? ", with texts that repeat" : "");
  }
  std::string operator()(const MessageWritten& message_written) const {
    return fmt::format("{}  message {} in element {}: \"{}\"", message_written.key.to_string(),
                       message_written.message, message_written.element,
                       gateway::printable(message_written.text));
  }
  std::string operator()(const MessagesGone& messages_gone) const {
    return fmt::format("{}  {}; gone: {}", messages_gone.key.to_string(), messages_gone.why,
                       fmt::join(messages_gone.messages, ", "));
  }
  std::string operator()(const MessagesRead& messages_read) const {
    return fmt::format("{}  gateway {} writes LastGet{}: {}", messages_read.key.to_string(),
                       messages_read.gateway, messages_read.crossed ? " too late" : "",
                       fmt::join(messages_read.messages, ", "));
  }
  std::string operator()(const OutcomeUnknown& outcome_unknown) const {
    return fmt::format("{}  no gateway can tell: {}", outcome_unknown.key.to_string(),
                       outcome_unknown.why);
  }
  std::string operator()(const MessageJournalled& message_journalled) const {
    return fmt::format("{}  gateway {} takes number {} from element {}: \"{}\"",
                       message_journalled.key.to_string(), message_journalled.gateway,
                       message_journalled.number, message_journalled.element,
                       gateway::printable(message_journalled.text));
  }
  std::string operator()(const MessageEnded& message_ended) const {
    return fmt::format("{}  gateway {}: number {} is answered", message_ended.key.to_string(),
                       message_ended.gateway, message_ended.number);
  }
  std::string operator()(const Note& note) const {
    return fmt::format("{}: {}", note.who, note.what);
  }
};

}  // namespace

Key key_at(const Key& key, GatewayNumber gateway) {
  return fabric::queue_of(key.machine).empty()
             ? key
             : Key{fmt::format("{}@{}", key.machine, gateway), key.channel};
}

std::string to_string(const Fact& fact) {
  return std::visit(Words{}, fact);
}

}  // namespace millrace::tests::simulation
