#include "tests/simulation/history/queue_check.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace millrace::tests::simulation {

std::vector<std::string> QueueCheck::on(const Fact& fact, Time) {
  std::visit([this](const auto& kind) { on(kind); }, fact);
  return std::exchange(violations_, {});
}

template <typename... Arguments>
void QueueCheck::expect(bool right, const char* what, const Arguments&... arguments) {
  if (!right) {
    violations_.push_back(fmt::format(fmt::runtime(what), arguments...));
  }
}

QueueCheck::Message* QueueCheck::find(Ring& ring, std::uint64_t message) {
  return message == 0 || message > ring.messages.size() ? nullptr : &ring.messages[message - 1];
}

void QueueCheck::on(const QueuePlanned& fact) {
  Ring& ring = rings_[fact.key];
  ring.when_answered = fact.when_answered;
  ring.repeats = fact.repeats;
}

void QueueCheck::on(const MessageWritten& fact) {
  Ring& ring = rings_[fact.key];
  ring.messages.push_back({.text = fact.text, .pardoned = ring.misleading});
  ring.elements[fact.element].push_back(fact.message);
}

void QueueCheck::on(const MessagesGone& fact) {
  for (const std::uint64_t message : fact.messages) {
    if (Message* const written = find(rings_[fact.key], message)) {
      written->pardoned = true;
    }
  }
}

void QueueCheck::on(const MessagesRead& fact) {
  Ring& ring = rings_[fact.key];
  for (const std::uint64_t number : fact.messages) {
    const Message* const message = find(ring, number);
    if (message == nullptr || message->pardoned) {
      continue;
    }
    if (ring.when_answered) {
      expect(message->answered_by.contains(fact.gateway),
             "LastGet of {} covers message {}, which gateway {} has not brought to its answer",
             fact.key.to_string(), number, fact.gateway);
    } else {
      expect(message->taken_by.contains(fact.gateway),
             "LastGet of {} covers message {}, which is not in the journal of gateway {}",
             fact.key.to_string(), number, fact.gateway);
    }
  }
  ring.misleading = ring.misleading && !fact.empty;
}

void QueueCheck::on(const OutcomeUnknown& fact) {
  Ring& ring = rings_[fact.key];
  ring.muddled = true;
  ring.misleading = true;
  for (Message& message : ring.messages) {
    message.pardoned = true;
  }
}

void QueueCheck::on(const MessageJournalled& fact) {
  Ring& ring = rings_[fact.key];
  // The message that was read may be gone: a program has initialised the queue and filled it again
  // between two reads. The order and the calls show whether it was read before.
  const std::vector<std::uint64_t>& stood = ring.elements[fact.element];
  const auto last = std::ranges::find_if(stood.rbegin(), stood.rend(), [&](std::uint64_t message) {
    return ring.messages[message - 1].text == fact.text;
  });
  const bool right = last != stood.rend();
  expect(right || ring.muddled, "gateway {} reads \"{}\" of element {} of {}, where it never stood",
         fact.gateway, fact.text, fact.element, fact.key.to_string());
  ring.numbers[{fact.gateway, fact.number}] = right ? *last : 0;
  names_[key_at(fact.key, fact.gateway)] = {fact.key, fact.gateway};
  if (right) {
    ring.messages[*last - 1].taken_by.insert(fact.gateway);
  }
}

void QueueCheck::on(const MessageEnded& fact) {
  Ring& ring = rings_[fact.key];
  const auto number = ring.numbers.find({fact.gateway, fact.number});
  if (Message* const message =
          number == ring.numbers.end() ? nullptr : find(ring, number->second)) {
    message->answered = true;
    message->answered_by.insert(fact.gateway);
  }
}

// After a change of the configured service and back, a call of the first one is a new request, even
// if no gateway has seen the change.
void QueueCheck::on(const ProgramAsked& fact) {
  const auto name = names_.find(fact.key);
  if (name == names_.end()) {
    return;
  }
  const auto& [key, gateway] = name->second;
  Ring& ring = rings_[key];
  const auto number = ring.numbers.find({gateway, fact.request.state});
  Message* const message = number == ring.numbers.end() ? nullptr : find(ring, number->second);
  if (message != nullptr && message->calls[gateway].uuid != fact.request.uuid) {
    Message::Called& called = message->calls[gateway];
    called = {fact.request.uuid, called.services + 1, {}};
    // Also behind a later message whose call the journal lost before anything relied on it.
    std::uint64_t& last = ring.claimed[gateway];
    last = std::min(last, number->second);
  }
}

void QueueCheck::on(const Claimed& fact) {
  const auto name = names_.find(fact.key);
  if (name == names_.end()) {
    return;
  }
  const auto& [key, gateway] = name->second;
  Ring& ring = rings_[key];
  const auto number = ring.numbers.find({gateway, fact.request.state});
  if (number == ring.numbers.end()) {
    return;
  }
  const std::uint64_t message = number->second;
  Message* const shown = find(ring, message);
  if (shown == nullptr) {
    return;
  }
  Message::Called& called = shown->calls[gateway];
  if (called.uuid != fact.request.uuid) {
    called = {fact.request.uuid, called.services + 1, {}};
  }
  calls_[fact.call] = {gateway, key, message, losses_[gateway], called.services};
  if (!shown->pardoned) {
    std::uint64_t& last = ring.claimed[gateway];
    expect(message >= last, "message {} of {} is called after message {}", message, key.to_string(),
           last);
    last = message;
  }
}

void QueueCheck::on(const Started& fact) {
  const auto call = calls_.find(fact.request.call);
  if (call == calls_.end() || call->second.losses != losses_[call->second.gateway]) {
    return;
  }
  const Origin& origin = call->second;
  Message* const message = find(rings_[origin.key], origin.message);
  if (message == nullptr || message->pardoned) {
    return;
  }
  Message::Called& called = message->calls[origin.gateway];
  if (called.services == origin.services) {
    called.first = called.first.value_or(call->first);
    expect(*called.first == call->first, "message {} of {} runs as {} and again as {}",
           origin.message, origin.key.to_string(), called.first->to_string(),
           call->first.to_string());
  }
}

void QueueCheck::on(const JournalLost& fact) {
  for (auto& [key, ring] : rings_) {
    for (Message& message : ring.messages) {
      if (ring.repeats || (!ring.when_answered && message.taken_by.contains(fact.gateway))) {
        message.pardoned = true;
      }
      message.calls.erase(fact.gateway);
    }
    ring.claimed.erase(fact.gateway);
    // A message in the element of one whose end the journal has lost may be taken for it.
    ring.misleading = ring.misleading || ring.repeats;
  }
  ++losses_[fact.gateway];
}

std::vector<std::string> QueueCheck::at_the_end() {
  for (const auto& [key, ring] : rings_) {
    for (std::size_t i = 0; i < ring.messages.size(); ++i) {
      const Message& message = ring.messages[i];
      expect(message.pardoned || message.answered, "I5: message {} of {}, \"{}\", is lost", i + 1,
             key.to_string(), message.text);
    }
  }
  return std::exchange(violations_, {});
}

}  // namespace millrace::tests::simulation
