#include "tests/simulation/gateway/confirmed.hpp"

#include <algorithm>

#include "fabric/cases.hpp"

namespace millrace::tests::simulation {

void Confirmed::on_start(const std::vector<gateway::CallRecord>& calls,
                         const gateway::NumbersEntry& numbers) {
  *this = {};
  numbers_ = numbers;
  for (const gateway::CallRecord& call : calls) {
    for (const gateway::Attempt& attempt : call.attempts) {
      attempts_.emplace(call.id, attempt.number, attempt.instance);
    }
    for (const std::uint32_t state : call.shown) {
      interims_.emplace(call.id, state);
    }
    if (call.answer) {
      answers_.insert(call.id);
    }
    if (call.clearing) {
      clearings_.insert(call.id);
    }
  }
}

void Confirmed::on_append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket) {
  pending_.push_back({entry, ticket});
}

void Confirmed::on_recorded(const gateway::Ticket& ticket) {
  const auto found = std::ranges::find(pending_, ticket, &Pending::ticket);
  if (found == pending_.end()) {
    return;
  }
  for (auto one = pending_.begin(); one <= found; ++one) {
    confirm(one->entry);
  }
  pending_.erase(pending_.begin(), found + 1);
}

void Confirmed::confirm(const gateway::JournalEntry& entry) {
  std::visit(fabric::Cases{
                 [&](const gateway::NumbersEntry& one) { numbers_ = one; },
                 [&](const gateway::DispatchedEntry& one) {
                   attempts_.emplace(one.call, one.attempt, one.instance);
                 },
                 [&](const gateway::InterimEntry& one) { interims_.emplace(one.call, one.state); },
                 [&](const gateway::AnsweredEntry& one) { answers_.insert(one.call); },
                 [&](const gateway::ClearingEntry& one) { clearings_.insert(one.call); },
                 [](const auto&) {},
             },
             entry);
}

bool Confirmed::number(const fabric::CallId& call) const {
  return call.epoch == numbers_.epoch && call.number < numbers_.reserved;
}

bool Confirmed::attempt(const fabric::Request& request) const {
  return attempts_.contains({request.call, request.attempt, request.assigned});
}

bool Confirmed::message(const Key& queue, std::uint32_t element) const {
  return std::ranges::none_of(pending_, [&](const Pending& one) {
    const auto* const message = std::get_if<gateway::MessageEntry>(&one.entry);
    return message != nullptr && message->key == queue && message->element == element;
  });
}

}  // namespace millrace::tests::simulation
