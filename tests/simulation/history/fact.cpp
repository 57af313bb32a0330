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
  std::string operator()(const ProgramAsked& one) const {
    return fmt::format("{}  program asks {}", one.key.to_string(), text_of(one.request));
  }
  std::string operator()(const ProgramMoved& one) const {
    return fmt::format("{}  {}", one.key.to_string(), one.why);
  }
  std::string operator()(const KernelClears& one) const {
    return fmt::format("{}  kernel clears REQUEST_STATE itself", one.key.to_string());
  }
  std::string operator()(const ResponseEmptied& one) const {
    return fmt::format("{}  program empties RESPONSE", one.key.to_string());
  }
  std::string operator()(const ProgramReleased& one) const {
    return fmt::format("{}  program continues with state {}, \"{}\"", one.key.to_string(),
                       one.state, gateway::printable(one.text));
  }
  std::string operator()(const SnapshotRead& one) const {
    return fmt::format("{}  gateway {} read:{}", one.key.to_string(), one.gateway,
                       text_of(one.snapshot));
  }
  std::string operator()(const WriteAsked& one) const {
    return fmt::format("{}  gateway {} sends {} for {}", one.key.to_string(), one.gateway,
                       name_of(one.variable).substr(12), one.call.to_string());
  }
  std::string operator()(const Answered& one) const {
    return fmt::format("gateway {} has the answer of {}", one.gateway, one.call.to_string());
  }
  std::string operator()(const WriteDone& one) const {
    return fmt::format("{}  {} = {} by gateway {} for {}", one.key.to_string(),
                       name_of(one.variable).substr(12), text_of(one.value), one.gateway,
                       one.call.to_string());
  }
  std::string operator()(const Claimed& one) const {
    return fmt::format("{}  gateway {} accepts {} as {}", one.key.to_string(), one.gateway,
                       text_of(one.request), one.call.to_string());
  }
  std::string operator()(const Dispatched& one) const {
    return fmt::format("{}  gateway {} dispatches {} to {}, attempt {}", one.key.to_string(),
                       one.gateway, one.call.to_string(), short_of(one.instance), one.attempt);
  }
  std::string operator()(const Ended& one) const {
    return fmt::format("{}  gateway {}: {} is over{}", one.key.to_string(), one.gateway,
                       one.call.to_string(), one.answered ? "" : ", unanswered");
  }
  std::string operator()(const Resumed& one) const {
    return fmt::format("{}  gateway {} finds {} in its journal", one.key.to_string(), one.gateway,
                       one.call.to_string());
  }
  std::string operator()(const Heard& one) const {
    return fmt::format("{}  gateway {} hears of {}", one.key.to_string(), one.gateway,
                       one.call.to_string());
  }
  std::string operator()(const Refused& one) const {
    return fmt::format("{}  gateway {} leaves it to another one", one.key.to_string(), one.gateway);
  }
  std::string operator()(const Started& one) const {
    return fmt::format("{}  instance {} starts {}, attempt {}", one.request.key.to_string(),
                       short_of(one.instance), one.request.call.to_string(), one.request.attempt);
  }
  std::string operator()(const Finished& one) const {
    return fmt::format("instance {} has finished {}", short_of(one.instance), one.call.to_string());
  }
  std::string operator()(const Cancelled& one) const {
    return fmt::format("instance {} gets a cancellation of {}", short_of(one.instance),
                       one.call.to_string());
  }
  std::string operator()(const Replied& one) const {
    return fmt::format("{}  instance {} replies {}", one.reply.key.to_string(),
                       short_of(one.instance), text_of(one.reply));
  }
  std::string operator()(const ReplyReceived& one) const {
    return fmt::format("{}  gateway {} takes {}{}", one.reply.key.to_string(), one.gateway,
                       text_of(one.reply), one.refusal_told ? " and refuses it" : "");
  }
  std::string operator()(const EventPublished& one) const {
    return fmt::format("{}  gateway {} publishes {} of {}, attempt {}", one.event.key.to_string(),
                       one.gateway, fabric::name_of(one.event.kind), one.event.call.to_string(),
                       one.event.attempt);
  }
  std::string operator()(const Retried& one) const {
    return fmt::format("operator: retry {}", one.call.to_string());
  }
  std::string operator()(const JournalLost& one) const {
    return fmt::format("gateway {} has lost the end of its journal", one.gateway);
  }
  std::string operator()(const QueuePlanned& one) const {
    return fmt::format("{}  is a message queue{}{}", one.key.to_string(),
                       one.when_answered ? ", drained when answered" : "",
                       one.repeats ? ", with texts that repeat" : "");
  }
  std::string operator()(const MessageWritten& one) const {
    return fmt::format("{}  message {} in element {}: \"{}\"", one.key.to_string(), one.message,
                       one.element, gateway::printable(one.text));
  }
  std::string operator()(const MessagesGone& one) const {
    return fmt::format("{}  {}; gone: {}", one.key.to_string(), one.why,
                       fmt::join(one.messages, ", "));
  }
  std::string operator()(const MessagesRead& one) const {
    return fmt::format("{}  gateway {} writes LastGet{}: {}", one.key.to_string(), one.gateway,
                       one.crossed ? " too late" : "", fmt::join(one.messages, ", "));
  }
  std::string operator()(const OutcomeUnknown& one) const {
    return fmt::format("{}  no gateway can tell: {}", one.key.to_string(), one.why);
  }
  std::string operator()(const MessageJournalled& one) const {
    return fmt::format("{}  gateway {} takes number {} from element {}: \"{}\"",
                       one.key.to_string(), one.gateway, one.number, one.element,
                       gateway::printable(one.text));
  }
  std::string operator()(const MessageEnded& one) const {
    return fmt::format("{}  gateway {}: number {} is answered", one.key.to_string(), one.gateway,
                       one.number);
  }
  std::string operator()(const Note& one) const { return fmt::format("{}: {}", one.who, one.what); }
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
