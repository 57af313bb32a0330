// Observes a gateway: makes facts for the history of what it receives and decides.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "gateway/call_record.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/outputs.hpp"
#include "gateway/policy.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/history/fact.hpp"
#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

// What the journal of a gateway has confirmed, and what may not leave the gateway before that
// (gateway/journal_entry.hpp): a power cut that undoes such a step makes a call run twice.

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

class GatewayChecker {
 public:
  GatewayChecker(GatewayNumber number, History& history) : number_(number), history_(history) {}

  /// It starts and finds these calls in its journal.
  void on_start(const std::vector<gateway::CallRecord>& open_calls,
                const gateway::NumbersEntry& numbers, gateway::Policies policies);
  void on_end();
  /// Policies for calls that are accepted from now on.
  void on_policies(gateway::Policies policies) { policies_ = std::move(policies); }

  void on_ready(const fabric::InstanceIdentity& instance) { ready_[instance.id] = instance; }
  void on_gone(const fabric::InstanceId& instance) { ready_.erase(instance); }
  void on_channel_status(const fabric::ChannelStatus& status);
  void on_not_owner(const Key& key) { history_.add(Refused{number_, key}); }

  void on_tell(const Key& key, const fabric::Event& event, bool in_trouble, bool ending);
  void on_record(const gateway::JournalEntry& entry, const gateway::Ticket& ticket);
  void on_recorded(const gateway::Ticket& ticket) { confirmed_.on_recorded(ticket); }
  void on_publish(const fabric::Request& request);
  void on_dispose(const fabric::RequestKey& request) { published_.erase(request); }
  /// It is about to write LastGet.
  void on_last_get(const Key& queue, std::uint32_t element);
  void on_write(const Key& key, gateway::Variable variable, const gateway::Value& value);
  /// A reply arrives; `take` lets the gateway decide about it.
  void on_reply(const fabric::Reply& reply, const std::function<void()>& take);
  void on_retried(const fabric::CallId& call);

  // For a message queue, in whose channel the gateway itself writes the requests: what it shows
  // counts as read.
  void on_shown(const Key& key, const gateway::ServiceSnapshot& all);
  void on_window_written(const Key& key, gateway::Variable variable, const gateway::Value& value,
                         const gateway::ServiceSnapshot& all);
  [[nodiscard]] Key seen_as(const Key& key) const { return key_at(key, number_); }

  /// A write with its context.
  [[nodiscard]] AdsWrite describe(const Key& key, gateway::Variable variable,
                                  const gateway::Value& value) const;
  /// The channel's call; an empty id if there is none.
  [[nodiscard]] fabric::CallId call_of(const Key& key) const;
  /// It has the call's final answer.
  [[nodiscard]] bool answering(const Key& key) const;
  /// The progress of the channel's call, which is in this state (faults/fault_injector.hpp).
  [[nodiscard]] std::string_view step_of(const Key& key, fabric::ChannelState state) const;
  [[nodiscard]] bool at_most_once(const Key& key) const;

 private:
  /// The call of a channel, according to the gateway's actions.
  struct Current {
    fabric::CallId call;
    gateway::PendingRequest request;
    std::optional<gateway::Answer> answer;
    gateway::Policy policy;
    /// The instances that it was dispatched to.
    std::set<fabric::InstanceId> asked{};
    bool over = false;
    fabric::CompletionSignal completion_signal{};
    fabric::Delivery delivery{};
    /// The last variable written of its answer, or of an interim one before there is an answer.
    std::optional<gateway::Variable> written{};
  };

  void given_out(const gateway::DispatchedEntry& entry);
  void answered(const Current& current);
  void judge_confirmed(const Current& current, gateway::Variable variable,
                       const gateway::Value& value);
  void expect_confirmed(bool confirmed, const fabric::CallId& call, const char* what);

  [[nodiscard]] gateway::Policy policy_of(const Key& key, const std::string& uuid) const;

  GatewayNumber number_;
  History& history_;
  Confirmed confirmed_;
  gateway::Policies policies_;
  std::map<Key, Current> current_;
  /// The channels of calls that are not over.
  std::map<fabric::CallId, Key> keys_;
  std::map<fabric::InstanceId, fabric::InstanceIdentity> ready_;
  std::map<fabric::CallId, fabric::InstanceId> given_;
  /// The last message of each queue that is in the history.
  std::map<Key, gateway::PendingRequest> shown_;
  /// The published requests and their calls.
  std::map<fabric::RequestKey, fabric::CallId> published_;
  /// How often it has reported that a call, or a reply to it, is late.
  std::map<fabric::CallId, unsigned> lates_;
  /// The last call for which it has reported that an answer is refused.
  fabric::CallId refusal_reported_;
};

}  // namespace millrace::tests::simulation
