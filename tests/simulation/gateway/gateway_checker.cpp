#include "tests/simulation/gateway/gateway_checker.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "fabric/cases.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"

namespace millrace::tests::simulation {

namespace {

/// A call is late once, and each of its instances may also be late.
constexpr unsigned too_often = 20;

}  // namespace

void GatewayChecker::on_start(const std::vector<gateway::CallRecord>& open_calls,
                              const gateway::NumbersEntry& numbers, gateway::Policies policies) {
  confirmed_.on_start(open_calls, numbers);
  policies_ = std::move(policies);
  history_.add(Resumed{number_, {}, {}, {}, false});
  for (const gateway::CallRecord& call : open_calls) {
    const std::string uuid = fabric::canonical_uuid(call.request.uuid);
    keys_[call.id] = call.key;
    Current& current = current_[call.key];
    current = {call.id, call.request, call.answer, policy_of(call.key, uuid)};
    current.completion_signal = call.completion_signal;
    current.delivery = call.delivery;
    if (call.clearing) {
      current.written = gateway::Variable::request_state;
    }
    for (const gateway::Attempt& attempt : call.attempts) {
      current.asked.insert(attempt.instance);
    }
    history_.add(Resumed{number_, seen_as(call.key), call.id, call.request, call.clearing});
  }
}

void GatewayChecker::on_end() {
  current_.clear();
  keys_.clear();
  ready_.clear();
  given_.clear();
  published_.clear();
  lates_.clear();
}

void GatewayChecker::on_channel_status(const fabric::ChannelStatus& status) {
  if (status.call != fabric::CallId{}) {
    history_.add(ChannelStatusReceived{number_, seen_as(status.key), status.call});
  }
}

void GatewayChecker::on_tell(const Key& key, const fabric::Event& event, bool in_trouble,
                             bool ending) {
  using fabric::EventKind;
  if (event.kind == EventKind::seen) {
    if (ending) {
      history_.violated(fmt::format("{} is claimed although gateway {} is to end",
                                    event.call.to_string(), number_));
    }
    const gateway::PendingRequest request{event.uuid, event.text, event.state};
    const std::string uuid = fabric::canonical_uuid(event.uuid);
    keys_[event.call] = key;
    current_[key] = {event.call, request, {}, policy_of(key, uuid)};
    expect_confirmed(confirmed_.number(event.call), event.call, "its number");
    history_.add(Claimed{number_, seen_as(key), event.call, request, in_trouble});
  } else if (event.kind == EventKind::late && ++lates_[event.call] == too_often) {
    history_.violated(fmt::format("gateway {} says {} times that {} is late", number_, too_often,
                                  event.call.to_string()));
  } else if (event.kind == EventKind::lost || event.kind == EventKind::refused) {
    given_.erase(event.call);
    if (event.kind == EventKind::refused) {
      refusal_reported_ = event.call;
    }
  }
  history_.add(EventPublished{number_, event});
}

void GatewayChecker::expect_confirmed(bool confirmed, const fabric::CallId& call,
                                      const char* what) {
  if (!confirmed) {
    history_.violated(
        fmt::format("gateway {} relies on {} of {} before the journal has confirmed it", number_,
                    what, call.to_string()));
  }
}

void GatewayChecker::on_publish(const fabric::Request& request) {
  const fabric::RequestKey own = fabric::key_of(request);
  for (const auto& [key, call] : published_) {
    if (call == request.call && key != own) {
      history_.violated(
          fmt::format("{} is asked of an instance while another one still is", call.to_string()));
    }
  }
  published_.insert_or_assign(own, request.call);
  expect_confirmed(confirmed_.attempt(request), request.call, "an attempt");
}

void GatewayChecker::on_last_get(const Key& queue, std::uint32_t element) {
  if (!confirmed_.message(queue, element)) {
    history_.violated(
        fmt::format("gateway {} takes element {} out of {} before the journal has "
                    "confirmed its message",
                    number_, element, queue.to_string()));
  }
}

/// The writes of an interim answer may be completed when the final one has arrived.
void GatewayChecker::judge_confirmed(const Current& current, gateway::Variable variable,
                                     const gateway::Value& value) {
  const auto* const state = std::get_if<std::uint32_t>(&value);
  const bool is_final =
      current.answer && (state == nullptr ? value == gateway::Value{current.answer->text}
                                          : *state == current.answer->state);
  if (variable == gateway::Variable::request_state) {
    expect_confirmed(confirmed_.clearing(current.call), current.call, "the clearing");
  } else if (is_final) {
    expect_confirmed(confirmed_.answer(current.call), current.call, "the answer");
  } else if (variable == gateway::Variable::response_state) {
    expect_confirmed(confirmed_.interim(current.call, *state), current.call, "an interim state");
  }
}

void GatewayChecker::on_record(const gateway::JournalEntry& entry, const gateway::Ticket& ticket) {
  confirmed_.on_append(entry, ticket);
  if (const auto* dispatched = std::get_if<gateway::DispatchedEntry>(&entry)) {
    if (dispatched->attempt > 0) {
      Current& current = current_.at(dispatched->key);
      current.asked.insert(dispatched->instance);
      current.completion_signal = dispatched->completion_signal;
      current.delivery = dispatched->delivery;
      given_out(*dispatched);
    }
  } else if (const auto* answer = std::get_if<gateway::AnsweredEntry>(&entry)) {
    Current& current = current_.at(keys_.at(answer->call));
    current.answer = answer->answer;
    current.written.reset();
    history_.add(Answered{number_, answer->call, answer->answer});
    answered(current);
    given_.erase(answer->call);
  } else if (const auto* ended = std::get_if<gateway::EndedEntry>(&entry)) {
    given_.erase(ended->call);
    const Key key = keys_.at(ended->call);
    keys_.erase(ended->call);
    Current& current = current_.at(key);
    const bool is_current = current.call == ended->call;
    current.over = current.over || is_current;
    history_.add(Ended{number_, seen_as(key), ended->call, is_current && current.answer});
  } else if (const auto* taken = std::get_if<gateway::MessageEntry>(&entry)) {
    history_.add(
        MessageJournalled{number_, taken->key, taken->number, taken->element, taken->text});
  } else if (const auto* message = std::get_if<gateway::MessageEndedEntry>(&entry)) {
    history_.add(MessageEnded{number_, message->key, message->number});
  }
}

void GatewayChecker::answered(const Current& current) {
  const gateway::Answer& answer = *current.answer;
  if (answer.instance != fabric::InstanceId{} || !answer.text.starts_with("millrace: ")) {
    return;
  }
  const auto& policy = current.policy;
  const bool configured = std::ranges::any_of(
      std::array{policy.unserved, policy.deadline, policy.lost, policy.refused},
      [&](const auto& rule) { return rule && rule->response_state == answer.state; });
  if (!configured) {
    history_.violated(
        fmt::format("{} is answered by the gateway with state {}, which the policy under which it "
                    "was accepted does not have",
                    current.call.to_string(), answer.state));
  }
}

void GatewayChecker::given_out(const gateway::DispatchedEntry& entry) {
  Dispatched fact;
  fact.gateway = number_;
  fact.key = seen_as(entry.key);
  fact.call = entry.call;
  fact.attempt = entry.attempt;
  fact.instance = entry.instance;
  fact.delivery = entry.delivery;
  const auto found = ready_.find(entry.instance);
  fact.ready = found != ready_.end() && !found->second.draining &&
               found->second.uuid == fabric::canonical_uuid(entry.request.uuid);
  if (found != ready_.end()) {
    fact.room = found->second.concurrency;
    const auto& scopes = found->second.channels;
    fact.ready =
        fact.ready && (scopes.empty() || std::ranges::any_of(scopes, [&](const auto& scope) {
                         return (scope.machine.empty() || scope.machine == entry.key.machine ||
                                 scope.machine == fabric::machine_of(entry.key.machine)) &&
                                (scope.channel == 0 || scope.channel == entry.key.channel);
                       }));
  }
  fact.load = static_cast<std::uint32_t>(std::ranges::count_if(given_, [&](const auto& given) {
    return given.second == entry.instance && given.first != entry.call;
  }));
  given_[entry.call] = entry.instance;
  history_.add(fact);
}

void GatewayChecker::on_write(const Key& key, gateway::Variable variable,
                              const gateway::Value& value) {
  Current& current = current_.at(key);
  judge_confirmed(current, variable, value);
  current.written = variable;
  history_.add(WriteAsked{number_, seen_as(key), current.call, current.request, variable, value,
                          current.completion_signal});
}

void GatewayChecker::on_reply(const fabric::Reply& reply, const std::function<void()>& take) {
  ReplyReceived fact;
  fact.gateway = number_;
  fact.reply = reply;
  const auto found = current_.find(reply.key);
  if (found != current_.end()) {
    const Current& current = found->second;
    fact.completion_signal = current.call == reply.call && !current.over && !current.answer &&
                             current.asked.contains(reply.instance);
    fact.program_awaits = current.completion_signal;
    fact.refused = current.policy.refused;
    fact.before = current.answer;
  }
  refusal_reported_ = {};
  const auto given = given_.find(reply.call);
  if (reply.kind == fabric::ReplyKind::declined && given != given_.end() &&
      given->second == reply.instance) {
    given_.erase(given);
  }
  take();
  fact.now = found == current_.end() ? std::nullopt : found->second.answer;
  fact.refusal_reported = refusal_reported_ != fabric::CallId{};
  history_.add(fact);
}

AdsWrite GatewayChecker::describe(const Key& key, gateway::Variable variable,
                                  const gateway::Value& value) const {
  const Current& current = current_.at(key);
  // An interim answer may still be under way when the final one has arrived.
  const bool text_last = current.completion_signal == fabric::CompletionSignal::response;
  const bool releases =
      variable == (text_last ? gateway::Variable::response : gateway::Variable::response_state);
  const bool is_final = current.answer && releases &&
                        value == (text_last ? gateway::Value{current.answer->text}
                                            : gateway::Value{current.answer->state});
  return {variable, value, current.call, current.request, is_final ? current.answer : std::nullopt};
}

void GatewayChecker::on_retried(const fabric::CallId& call) {
  given_.erase(call);
  history_.add(Retried{call});
}

gateway::Policy GatewayChecker::policy_of(const Key& key, const std::string& uuid) const {
  return policies_.of(std::string(fabric::machine_of(key.machine)), uuid);
}

void GatewayChecker::on_shown(const Key& key, const gateway::ServiceSnapshot& all) {
  const gateway::PendingRequest shown{all.uuid, all.request, all.request_state};
  gateway::PendingRequest& before = shown_[key];
  if (shown.state != 0 && shown != before) {
    before = shown;
    history_.add(ProgramAsked{seen_as(key), shown});
  }
}

void GatewayChecker::on_window_written(const Key& key, gateway::Variable variable,
                                       const gateway::Value& value,
                                       const gateway::ServiceSnapshot& all) {
  const AdsWrite write = describe(key, variable, value);
  // Where RESPONSE is written last, the next message may be there before it.
  const std::uint32_t request_state =
      all.request_state == write.request.state ? all.request_state : 0;
  history_.add(WriteDone{number_, seen_as(key), write.call, write.request, variable, write.answer,
                         value, all.response, request_state});
  if (write.answer) {
    // A gateway that forgets the call shows the message again.
    shown_.erase(key);
    history_.add(ProgramReleased{seen_as(key), write.request, false, all.response,
                                 all.response_state, variable == gateway::Variable::response});
  }
}

fabric::CallId GatewayChecker::call_of(const Key& key) const {
  const auto found = current_.find(key);
  return found == current_.end() ? fabric::CallId{} : found->second.call;
}

std::string_view GatewayChecker::step_of(const Key& key, fabric::ChannelState state) const {
  const auto found = current_.find(key);
  const auto written = found == current_.end() ? std::nullopt : found->second.written;
  if (!written ||
      (state != fabric::ChannelState::running && state != fabric::ChannelState::answering)) {
    return fabric::name_of(state);
  }
  if (!found->second.answer) {
    return "interim";
  }
  const bool text_last = found->second.completion_signal == fabric::CompletionSignal::response;
  if (*written == gateway::Variable::request_state) {
    return "cleared";
  }
  return (*written == gateway::Variable::response) == text_last ? "released" : "begun";
}

bool GatewayChecker::at_most_once(const Key& key) const {
  const auto found = current_.find(key);
  return found != current_.end() && found->second.delivery == fabric::Delivery::at_most_once;
}

bool GatewayChecker::answering(const Key& key) const {
  const auto found = current_.find(key);
  return found != current_.end() && found->second.answer;
}

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
  for (auto confirmed = pending_.begin(); confirmed <= found; ++confirmed) {
    confirm(confirmed->entry);
  }
  pending_.erase(pending_.begin(), found + 1);
}

void Confirmed::confirm(const gateway::JournalEntry& entry) {
  std::visit(fabric::Cases{
                 [&](const gateway::NumbersEntry& numbers) { numbers_ = numbers; },
                 [&](const gateway::DispatchedEntry& dispatched_entry) {
                   attempts_.emplace(dispatched_entry.call, dispatched_entry.attempt,
                                     dispatched_entry.instance);
                 },
                 [&](const gateway::InterimEntry& interim_entry) {
                   interims_.emplace(interim_entry.call, interim_entry.state);
                 },
                 [&](const gateway::AnsweredEntry& answered_entry) {
                   answers_.insert(answered_entry.call);
                 },
                 [&](const gateway::ClearingEntry& clearing_entry) {
                   clearings_.insert(clearing_entry.call);
                 },
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
  return std::ranges::none_of(pending_, [&](const Pending& pending) {
    const auto* const message = std::get_if<gateway::MessageEntry>(&pending.entry);
    return message != nullptr && message->key == queue && message->element == element;
  });
}

}  // namespace millrace::tests::simulation
