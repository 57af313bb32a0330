// What the journal of a gateway has confirmed, and what may not leave the gateway before that
// (gateway/journal_entry.hpp): a power cut that undoes such a step makes a call run twice.
#pragma once

#include <deque>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "gateway/call_record.hpp"
#include "gateway/journal_entry.hpp"
#include "tests/simulation/history/fact.hpp"

namespace millrace::tests::simulation {

class Confirmed {
 public:
  /// The gateway starts with the content of its journal.
  void on_start(const std::vector<gateway::CallRecord>& calls,
                const gateway::NumbersEntry& numbers);
  void on_append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket);
  /// Confirms this entry and all that were appended before it.
  void on_recorded(const gateway::Ticket& ticket);

  [[nodiscard]] bool number(const fabric::CallId& call) const;
  [[nodiscard]] bool attempt(const fabric::Request& request) const;
  [[nodiscard]] bool answer(const fabric::CallId& call) const { return answers_.contains(call); }
  [[nodiscard]] bool interim(const fabric::CallId& call, std::uint32_t state) const {
    return interims_.contains({call, state});
  }
  [[nodiscard]] bool clearing(const fabric::CallId& call) const {
    return clearings_.contains(call);
  }
  /// Whether a message read from this element of a queue is confirmed.
  [[nodiscard]] bool message(const Key& queue, std::uint32_t element) const;

 private:
  void confirm(const gateway::JournalEntry& entry);

  struct Pending {
    gateway::JournalEntry entry;
    gateway::Ticket ticket;
  };
  std::deque<Pending> pending_;
  gateway::NumbersEntry numbers_;
  std::set<std::tuple<fabric::CallId, std::uint32_t, fabric::InstanceId>> attempts_;
  std::set<std::pair<fabric::CallId, std::uint32_t>> interims_;
  std::set<fabric::CallId> answers_;
  std::set<fabric::CallId> clearings_;
};

}  // namespace millrace::tests::simulation
