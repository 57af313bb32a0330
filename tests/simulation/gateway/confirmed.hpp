// What the journal of a gateway has confirmed, and what may not leave the gateway before that
// (gateway/journal_entry.hpp): a step that a power cut can make undone runs a call twice.
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
  /// The gateway starts with what its journal holds.
  void on_start(const std::vector<gateway::CallRecord>& calls,
                const gateway::NumbersEntry& numbers);
  void on_append(const gateway::JournalEntry& entry, const gateway::Ticket& ticket);
  /// With this one all that was appended before.
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
  /// What has been read of this element of a queue.
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
