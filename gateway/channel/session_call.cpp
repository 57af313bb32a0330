// The call of a channel: given to instances, settled without them, over.
#include <utility>

#include <fmt/format.h>

#include "gateway/channel/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

std::string after(std::chrono::nanoseconds time) {
  return fmt::format(" after {:.1f} ms", std::chrono::duration<double, std::milli>(time).count());
}

}  // namespace

Actions ChannelSession::assign(const Assignment& assignment, Moment now) {
  if (!active_ || active_->call.answer) {
    return {};
  }
  Active& active = *active_;
  Call& call = active.call;
  const bool repeated = !call.attempts.empty() && call.attempts.back() == assignment.attempt;
  active.assignment = assignment;
  active.held = false;
  active.lost_since.reset();
  active.lost_told = false;
  active.reason.clear();
  if (repeated) {
    if (active.dispatch_ticket == 0) {
      publish(now);
    }
    return finish(now);
  }
  call.attempts.push_back(assignment.attempt);
  call.delivery = assignment.delivery;
  if (call.attempts.size() > 1) {
    ++status_.repeated;
  }
  active.dispatch_ticket =
      record(DispatchedEntry{call.id, key_, call.request, call.seen, call.delivery,
                             assignment.attempt.number, assignment.attempt.instance});
  return finish(now);
}

Actions ChannelSession::suspend(const std::string& reason, bool held, Moment now) {
  if (!active_ || active_->call.answer) {
    return {};
  }
  tell(fabric::EventKind::lost, reason, now);
  if (held) {
    tell(fabric::EventKind::held, reason, now);
  }
  say(Level::warn, fmt::format("call {}: {}", active_->call.id.to_string(), reason));
  active_->assignment.reset();
  active_->dispatch_ticket = 0;
  active_->held = held;
  if (held) {
    active_->lost_since = now.steady;
  }
  active_->reason = reason;
  return finish(now);
}

Actions ChannelSession::hold(const std::string& reason, Moment now) {
  Call& call = active_->call;
  call.delivery = fabric::Delivery::at_most_once;
  // Opens the call in the journal; nobody was asked by us.
  record(DispatchedEntry{call.id, key_, call.request, call.seen, call.delivery, 0, {}});
  return suspend(reason, true, now);
}

Actions ChannelSession::explain(const std::string& reason, Moment now) {
  if (active_ && !active_->assignment && !active_->held) {
    active_->reason = reason;
  }
  return finish(now);
}

void ChannelSession::publish(Moment now) {
  const Active& active = *active_;
  fabric::Request request;
  request.key = key_;
  request.call = active.call.id;
  request.attempt = active.assignment->attempt.number;
  request.assigned = active.assignment->attempt.instance;
  request.uuid = active.call.request.uuid;
  request.text = active.call.request.text;
  request.state = active.call.request.state;
  if (policy_.deadline) {
    request.deadline = active.call.seen + policy_.deadline->after;
  }
  request.seen = active.call.seen;
  request.dispatched = now.wall;
  put(Publish{std::move(request)});
  tell(fabric::EventKind::dispatched, active.assignment->name, now);
  say(Level::debug, fmt::format("call {} given to {}, attempt {}", active.call.id.to_string(),
                                active.assignment->name, active.assignment->attempt.number));
}

void ChannelSession::end(bool answered, const std::string& detail, Moment now) {
  const Call& call = active_->call;
  put(Record{0, EndedEntry{call.id}});
  tell(answered ? fabric::EventKind::written : fabric::EventKind::withdrawn, detail, now);
  if (!call.attempts.empty()) {
    // Who else was given it may be running it still.
    const bool nobody_runs_it = answered && call.attempts.size() == 1 &&
                                call.answer->instance == call.attempts.front().instance;
    nobody_runs_it ? put(LeaveBe{call.request.uuid})
                   : put(Withdraw{call.request.uuid, call.id.epoch});
  }
  put(Freed{call.id});
  const std::string took =
      active_->age_known ? after(std::chrono::nanoseconds(now.steady - active_->since)) : "";
  if (answered) {
    ++status_.answered;
    say(Level::info, fmt::format("call {} of {} answered with state {}{}", call.id.to_string(),
                                 printable(call.request.uuid), call.answer->state, took));
  } else {
    ++status_.withdrawn;
    say(Level::info, fmt::format("call {} of {} is over{}: {}", call.id.to_string(),
                                 printable(call.request.uuid), took, detail));
  }
  past_ = Past{call.id, answered, answered ? call.answer->instance : fabric::InstanceId{}};
  active_.reset();
  idle_seen_ = true;
  watch_.restart();
  due_ = now.steady;
  active_until_ = now.steady + pace_.active_for;
}

}  // namespace millrace::gateway::channel
