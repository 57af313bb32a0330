// What is seen of a gateway: makes facts for the history of what it takes in and decides.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/call_record.hpp"
#include "gateway/outputs.hpp"
#include "gateway/policy.hpp"
#include "tests/simulation/gateway/ads_link.hpp"
#include "tests/simulation/gateway/confirmed.hpp"
#include "tests/simulation/history/history.hpp"

namespace millrace::tests::simulation {

class GatewayChecker {
 public:
  GatewayChecker(GatewayNumber number, History& history) : number_(number), history_(history) {}

  /// It starts and finds these calls in its journal.
  void on_start(const std::vector<gateway::CallRecord>& open_calls,
                const gateway::NumbersEntry& numbers, gateway::Policies policies);
  void on_end();
  /// For calls that are claimed from now on.
  void on_policies(gateway::Policies policies) { policies_ = std::move(policies); }

  void on_ready(const fabric::InstanceIdentity& instance) { ready_[instance.id] = instance; }
  void on_gone(const fabric::InstanceId& instance) { ready_.erase(instance); }
  void on_heard(const fabric::ChannelStatus& status);
  void on_not_owner(const Key& key) { history_.add(Refused{number_, key}); }

  void on_tell(const Key& key, const fabric::Event& event, bool in_trouble, bool ending);
  void on_record(const gateway::JournalEntry& entry, const gateway::Ticket& ticket);
  void on_recorded(const gateway::Ticket& ticket) { confirmed_.on_recorded(ticket); }
  void on_publish(const fabric::Request& request);
  void on_dispose(const fabric::RequestKey& request) { published_.erase(request); }
  /// It is about to write LastGet.
  void on_last_get(const Key& queue, std::uint32_t element);
  void on_write(const Key& key, gateway::Variable variable, const gateway::Value& value);
  /// A reply comes; `take` has the gateway decide what becomes of it.
  void on_reply(const fabric::Reply& reply, const std::function<void()>& take);
  void on_retried(const fabric::CallId& call);

  // Of a message queue, whose channel the gateway plays itself.
  /// What is shown is looked at.
  void on_shown(const Key& key, const gateway::ServiceSnapshot& all);
  void on_window_written(const Key& key, gateway::Variable variable, const gateway::Value& value,
                         const gateway::ServiceSnapshot& all);
  [[nodiscard]] Key seen_as(const Key& key) const { return key_at(key, number_); }

  /// What the write is about.
  [[nodiscard]] AdsWrite describe(const Key& key, gateway::Variable variable,
                                  const gateway::Value& value) const;
  /// The channel's call; an empty id if there is none.
  [[nodiscard]] fabric::CallId call_of(const Key& key) const;
  /// Its final answer is there.
  [[nodiscard]] bool answering(const Key& key) const;
  /// How far the channel's call has come (faults/storm.hpp), of one that is in this state.
  [[nodiscard]] std::string_view step_of(const Key& key, fabric::ChannelState state) const;
  [[nodiscard]] bool at_most_once(const Key& key) const;

 private:
  /// The call of a channel, as the actions told of it.
  struct Current {
    fabric::CallId call;
    gateway::PendingRequest request;
    std::optional<gateway::Answer> answer;
    gateway::Policy policy;
    /// The instances it was given to.
    std::set<fabric::InstanceId> asked{};
    bool over = false;
    fabric::CompletionSignal completion_signal{};
    fabric::Delivery delivery{};
    /// Of its answer, or of an interim one before there is an answer.
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
  /// Of calls that are not over.
  std::map<fabric::CallId, Key> keys_;
  std::map<fabric::InstanceId, fabric::InstanceIdentity> ready_;
  std::map<fabric::CallId, fabric::InstanceId> given_;
  /// The last message of each queue that is known to the history.
  std::map<Key, gateway::PendingRequest> shown_;
  /// What instances are asked, and which calls these are.
  std::map<fabric::RequestKey, fabric::CallId> published_;
  /// How often it has said of a call that it, or a reply, is late.
  std::map<fabric::CallId, unsigned> lates_;
  /// The call that it said last of that an answer is refused.
  fabric::CallId refusal_told_;
};

}  // namespace millrace::tests::simulation
