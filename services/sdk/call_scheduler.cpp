#include "services/sdk/call_scheduler.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::services::sdk {

namespace {

using fabric::CallId;
using fabric::Moment;
using fabric::Reply;
using fabric::Request;
using fabric::RequestKey;
using fabric::ServiceCode;
using fabric::SteadyTime;
using fabric::Time;

Time counted_from(const Moment& start, SteadyTime now) {
  return start.wall + std::chrono::duration_cast<std::chrono::nanoseconds>(now - start.steady);
}

/// The reply that is sent in the end: the handler's response, or an error instead.
Reply final_reply(const Request& request, const Result& result,
                  const CallSchedulerOptions& options) {
  const std::string refusal =
      result ? check_response(*result, options.completion_signal) : std::string();
  if (result && refusal.empty()) {
    return reply_to(request, result->text, result->state);
  }
  // The log has the whole text.
  const Response error = Response::error(result ? refusal : result.error(), options.error_state);
  Reply reply = reply_to(request, error.text, error.state);
  reply.code = result ? ServiceCode::refused : ServiceCode::failed;
  return reply;
}

}  // namespace

Response Response::error(std::string_view reason, std::uint32_t state) {
  constexpr std::string_view more = "...";
  std::string text = "ERROR: ";
  text += reason.substr(0, reason.find('\0'));
  if (text.size() > fabric::max_text) {
    text.resize(fabric::max_text - more.size());
    text += more;
  }
  return {.text = std::move(text), .state = state};
}

std::string check_text(const std::string& text) {
  if (text.size() > fabric::max_text) {
    return fmt::format("the service's answer has {} bytes, at most {} fit", text.size(),
                       fabric::max_text);
  }
  if (text.find('\0') != std::string::npos) {
    return "the service's answer contains a NUL byte";
  }
  return {};
}

std::string check_response(const Response& response, fabric::CompletionSignal completion_signal) {
  if (completion_signal == fabric::CompletionSignal::response_state && response.state == 0) {
    return "the service answered with state 0, which would not release the program";
  }
  if (completion_signal == fabric::CompletionSignal::response && response.text.empty()) {
    return "the service answered without a text, which would not release the program";
  }
  return check_text(response.text);
}

CallKey CallScheduler::call_key_of(const Request& request) const {
  return {request.call, request.key,  options_.authenticated_requesters ? request.requester : 0,
          request.uuid, request.text, request.state};
}

Actions CallScheduler::on_request(const Request& request, Moment now) {
  Actions actions;
  supersede(request, actions);
  const CallKey name = call_key_of(request);
  if (const auto waiting = find_waiting(name); waiting != waiting_.end()) {
    waiting->request = request;
    requests_[key_of(request)].call = name;
  } else if (const auto running = find_running(name);
             running != running_.end() && !running->second.cancelled) {
    running->second.request.attempt = request.attempt;
    requests_[key_of(request)].call = name;
  } else if (const AnsweredCall* known_answer = answer_for(request)) {
    requests_[key_of(request)];
    repeat(known_answer->reply, request, actions);
  } else if (const auto why = reason_to_decline(request)) {
    ++counters_.declined;
    actions.emplace_back(Send{declined_reply(request, *why)});
  } else {
    waiting_.push_back({.request = request, .received = now});
    requests_[key_of(request)].call = name;
    counters_.last_call = now.wall;
  }
  start_waiting(now.steady, actions);
  return actions;
}

std::optional<fabric::Message> CallScheduler::reason_to_decline(const Request& request) const {
  const std::uint32_t* const declined = declined_.find(call_key_of(request));
  if (declined != nullptr && request.attempt <= *declined) {
    return base::messages::declined_before();
  }
  const bool full = running_.size() + waiting_.size() >= options_.concurrency;
  // Its own cancelled run ends before it runs again. Also if a restarted gateway asks: it would
  // dispatch the call to this instance again at once, and be declined again, until that run ends.
  const auto running = running_.find(request.call);
  const bool again = running != running_.end() && running->second.cancelled;
  if (full && !again && (!request.may_wait || waiting_.size() >= options_.most_waiting)) {
    return base::messages::no_room(options_.concurrency);
  }
  return std::nullopt;
}

Actions CallScheduler::decline(const Request& request, const fabric::Message& why) {
  Actions actions;
  if (const AnsweredCall* known_answer = answer_for(request)) {
    requests_[key_of(request)];
    repeat(known_answer->reply, request, actions);
  } else if (const CallKey name = call_key_of(request);
             find_running(name) == running_.end() && find_waiting(name) == waiting_.end()) {
    ++counters_.declined;
    actions.emplace_back(Send{declined_reply(request, why)});
  }
  return actions;
}

Reply CallScheduler::declined_reply(const Request& request, const fabric::Message& why) {
  declined_.put(request.requester, call_key_of(request), request.attempt);
  // A sample cannot have a longer text.
  Reply reply = reply_to(request, why.text.substr(0, fabric::max_text), 0);
  reply.kind = fabric::ReplyKind::declined;
  reply.reason = why;
  return reply;
}

Actions CallScheduler::on_withdrawn(const RequestKey& key) {
  Actions actions;
  if (const auto asked = requests_.extract(key); !asked.empty() && asked.mapped().call) {
    cancel_call(*asked.mapped().call, actions);
  }
  return actions;
}

/// DDS reports this when no requester of the call is left.
Actions CallScheduler::on_orphaned(const RequestKey& key) {
  Actions actions;
  std::vector<CallKey> lost;
  for (auto asked = requests_.lower_bound({key.key, key.epoch, key.instance});
       asked != requests_.end() && asked->first.key == key.key && asked->first.epoch == key.epoch &&
       asked->first.instance == key.instance;) {
    asked->second.orphaned = true;
    if (asked->second.call) {
      lost.push_back(*asked->second.call);
      ++asked;
    } else {
      asked = requests_.erase(asked);
    }
  }
  if (has_another_gateway(key)) {
    for (const CallKey& call : lost) {
      cancel_call(call, actions);
    }
  }
  return actions;
}

Actions CallScheduler::on_interim(CallId call, const Response& response, Moment now) {
  const auto running = running_.find(call);
  if (running == running_.end() || running->second.cancelled ||
      options_.completion_signal == fabric::CompletionSignal::response) {
    return {};
  }
  Reply reply = reply_to(running->second.request, response.text, response.state);
  reply.kind = fabric::ReplyKind::interim;
  reply.received = running->second.received.wall;
  reply.started = running->second.started;
  reply.answered = counted_from(running->second.received, now.steady);
  return {Send{std::move(reply)}};
}

template <typename Answer>
Actions CallScheduler::finish(CallId call, Moment now, Answer answer) {
  const auto running = running_.find(call);
  if (running == running_.end()) {
    return {};
  }
  Actions actions;
  if (running->second.cancelled) {
    actions.emplace_back(Drop{call});
  } else {
    actions.emplace_back(Send{answer(running->second)});
  }
  running_.erase(running);
  start_waiting(now.steady, actions);
  return actions;
}

Actions CallScheduler::on_result(CallId call, const Result& result, Moment now) {
  return finish(call, now,
                [&](const RunningCall& ended) { return end(ended, result, now.steady); });
}

Actions CallScheduler::on_declined(CallId call, const fabric::Message& why, Moment now) {
  return finish(call, now, [&](const RunningCall& ended) {
    ++counters_.declined;
    Reply reply = declined_reply(ended.request, why);
    forget_call(call_key_of(ended.request));
    return reply;
  });
}

Reply CallScheduler::end(const RunningCall& call, const Result& result, SteadyTime now) {
  Reply reply = final_reply(call.request, result, options_);
  reply.received = call.received.wall;
  reply.started = call.started;
  reply.answered = counted_from(call.received, now);
  handler_time_ += reply.answered - reply.started;
  ++counters_.answered;
  counters_.failed += reply.code == ServiceCode::ok ? 0 : 1;
  const CallKey name = call_key_of(call.request);
  forget_call(name);
  answered_.put(call.request.requester, name, {reply});
  return reply;
}

fabric::InstanceStatus CallScheduler::status() const {
  fabric::InstanceStatus status = counters_;
  status.instance = options_.instance;
  status.running = static_cast<std::uint32_t>(running_.size());
  if (status.answered > 0) {
    status.mean = handler_time_ / static_cast<std::int64_t>(status.answered);
  }
  return status;
}

fabric::InstanceLoad CallScheduler::load() const {
  // Far more than an instance may have at once.
  constexpr std::size_t most_named = 256;
  fabric::InstanceLoad load{.status = status()};
  for (const auto& [call, running] : running_) {
    load.calls.push_back(call);
  }
  for (const RunningCall& waiting : waiting_) {
    if (load.calls.size() < most_named) {
      load.calls.push_back(waiting.request.call);
      ++load.status.waiting;
    }
  }
  return load;
}

/// A gateway has one call of a channel at a time: a new one shows that the NC program has withdrawn
/// the old one. So does a new one of another gateway, if the old gateway is gone or has lost the
/// channel. A stranger cannot decide that it has lost it.
void CallScheduler::supersede(const Request& by, Actions& actions) {
  const CallKey name = call_key_of(by);
  std::vector<CallKey> over;
  std::vector<Reply> notices;
  for (auto asked = requests_.lower_bound({by.key, 0, {}});
       asked != requests_.end() && asked->first.key == by.key; ++asked) {
    const bool same_requester = asked->first.requester == by.requester;
    const bool same_gateway = same_requester && asked->first.epoch == by.call.epoch;
    asked->second.orphaned = asked->second.orphaned && !same_gateway;
    std::optional<CallKey>& call = asked->second.call;
    const bool over_there =
        asked->second.orphaned || (same_requester && asked->first.epoch == by.succeeds);
    if (call && *call != name && (same_gateway || over_there)) {
      over.push_back(*call);
      call.reset();
      if (!same_gateway && !asked->second.orphaned) {
        // It may be there after all, and would wait for an answer for ever.
        notices.push_back(reply_to_replaced(over.back()));
      }
    }
  }
  for (const CallKey& call : over) {
    cancel_call(call, actions);
  }
  for (Reply& reply : notices) {
    actions.emplace_back(Send{std::move(reply)});
  }
  for (auto asked = requests_.lower_bound({by.key, 0, {}});
       asked != requests_.end() && asked->first.key == by.key;) {
    const bool idle = asked->second.orphaned && !asked->second.call;
    asked = idle ? requests_.erase(asked) : std::next(asked);
  }
}

/// The reply to a gateway whose call is cancelled because another gateway owns the channel.
Reply CallScheduler::reply_to_replaced(const CallKey& call) {
  const fabric::Message why = base::messages::other_gateway_has_channel();
  // An attempt that waits for the end of a cancelled run is the one that the gateway still wants.
  if (const auto waiting = find_waiting(call); waiting != waiting_.end()) {
    return declined_reply(waiting->request, why);
  }
  const RunningCall& running = find_running(call)->second;
  return options_.delivery == fabric::Delivery::at_most_once ? cancelled_reply(running)
                                                             : declined_reply(running.request, why);
}

bool CallScheduler::has_another_gateway(const RequestKey& key) const {
  for (auto asked = requests_.lower_bound({key.key, 0, {}});
       asked != requests_.end() && asked->first.key == key.key; ++asked) {
    if (asked->first.epoch != key.epoch && !asked->second.orphaned) {
      return true;
    }
  }
  return false;
}

bool CallScheduler::is_wanted(const CallKey& call) const {
  for (auto asked = requests_.lower_bound({call.key, call.call.epoch, {}});
       asked != requests_.end() && asked->first.key == call.key &&
       asked->first.epoch == call.call.epoch;
       ++asked) {
    if (asked->second.call == call && !asked->second.orphaned) {
      return true;
    }
  }
  return false;
}

void CallScheduler::forget_call(const CallKey& call) {
  for (auto asked = requests_.lower_bound({call.key, call.call.epoch, {}});
       asked != requests_.end() && asked->first.key == call.key &&
       asked->first.epoch == call.call.epoch;) {
    if (asked->second.call == call) {
      asked->second.call.reset();
    }
    const bool over = asked->second.orphaned && !asked->second.call;
    asked = over ? requests_.erase(asked) : std::next(asked);
  }
}

/// Unless another requester wants the same call.
void CallScheduler::cancel_call(const CallKey& call, Actions& actions) {
  if (is_wanted(call)) {
    return;
  }
  forget_call(call);
  bool runs = false;
  if (const auto waiting = find_waiting(call); waiting != waiting_.end()) {
    waiting_.erase(waiting);
  } else if (const auto running = find_running(call); running != running_.end()) {
    cancel(running->second);
    runs = true;
  }
  ++counters_.cancelled;
  actions.emplace_back(Cancel{call.call, runs});
}

Reply CallScheduler::cancelled_reply(const RunningCall& running) const {
  const std::string reason = "the call was cancelled while it ran, and it must not run twice";
  Reply reply = final_reply(running.request, tl::unexpected(reason), options_);
  reply.received = running.received.wall;
  reply.started = running.started;
  reply.answered = running.started;
  return reply;
}

/// A later request for the call runs it again, unless that is not allowed.
void CallScheduler::cancel(RunningCall& running) {
  running.cancelled = true;
  if (options_.delivery == fabric::Delivery::at_least_once) {
    return;
  }
  answered_.put(running.request.requester, call_key_of(running.request),
                {cancelled_reply(running), true});
}

/// The stored answer, if `request` may get it: a new attempt of a cancelled call is an operator's
/// decision to run it again.
const CallScheduler::AnsweredCall* CallScheduler::answer_for(const Request& request) const {
  const AnsweredCall* const known_answer = answered_.find(call_key_of(request));
  const bool again = known_answer != nullptr && known_answer->cancelled &&
                     request.attempt > known_answer->reply.attempt;
  return again ? nullptr : known_answer;
}

void CallScheduler::repeat(const Reply& answered, const Request& request, Actions& actions) {
  Reply reply = answered;
  reply.attempt = request.attempt;
  if (reply.code == ServiceCode::ok) {
    // A failure or refusal repeats itself.
    reply.code = ServiceCode::repeated;
  }
  ++counters_.repeated;
  actions.emplace_back(Send{std::move(reply)});
}

void CallScheduler::start_waiting(SteadyTime now, Actions& actions) {
  for (auto next = waiting_.begin();
       next != waiting_.end() && running_.size() < options_.concurrency;) {
    const CallId call = next->request.call;
    if (running_.contains(call)) {
      // Its cancelled run has not ended yet, or another call with the same id has not.
      ++next;
      continue;
    }
    next->started = counted_from(next->received, now);
    actions.emplace_back(Start{next->request});
    running_.emplace(call, std::move(*next));
    next = waiting_.erase(next);
  }
}

std::map<CallId, CallScheduler::RunningCall>::iterator CallScheduler::find_running(
    const CallKey& call) {
  const auto running = running_.find(call.call);
  const bool same = running != running_.end() && call_key_of(running->second.request) == call;
  return same ? running : running_.end();
}

std::deque<CallScheduler::RunningCall>::iterator CallScheduler::find_waiting(const CallKey& call) {
  return std::find_if(waiting_.begin(), waiting_.end(), [&](const RunningCall& waiting) {
    return waiting.request.call == call.call && call_key_of(waiting.request) == call;
  });
}

}  // namespace millrace::services::sdk
