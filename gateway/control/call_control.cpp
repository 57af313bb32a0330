#include "gateway/control/call_control.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace millrace::gateway::control {

CallControl::CallControl(Outputs& port, CallControlOptions options, const journal::Ledger& ledger)
    : options_(std::move(options)),
      dispatcher_(options_.dispatcher),
      context_(port),
      epoch_(ledger.numbers().epoch),
      last_number_(ledger.numbers().reserved),
      recorded_(ledger.numbers().reserved),
      reserved_(ledger.numbers().reserved) {
  assert(epoch_ != 0);
  context_.standing.resume(ledger.standing());
  for (const Call& call : ledger.open_calls()) {
    open(call.key).resume(call, policy_of(call.key, fabric::canonical_uuid(call.request.uuid)));
  }
}

template <typename Step>
void CallControl::step(const fabric::ChannelKey& key, Moment now, Step step) {
  if (channel::ChannelSession* session = find(key)) {
    step(*session);
    follow(*session, now);
  }
  finish();
}

void CallControl::set_told(const fabric::ChannelKey& key, bool told, Moment now) {
  step(key, now, [&](channel::ChannelSession& session) { session.set_told(told, now); });
}

void CallControl::on_change(const fabric::ChannelKey& key, Variable variable, Moment now) {
  step(key, now, [&](channel::ChannelSession& session) { session.on_change(variable, now); });
}

void CallControl::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot, Moment now) {
  if (!inherited_.empty() && snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    forget_looked_at(key);
  }
  if (snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    context_.standing.forget(key);
  }
  step(key, now, [&](channel::ChannelSession& session) { session.on_read(snapshot, now); });
}

void CallControl::on_read_failed(const fabric::ChannelKey& key, const std::string& reason,
                                 Moment now) {
  step(key, now, [&](channel::ChannelSession& session) { session.on_read_failed(reason, now); });
}

void CallControl::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                           const std::string& reason, Moment now) {
  step(key, now, [&](channel::ChannelSession& session) { session.on_write(outcome, reason, now); });
}

void CallControl::on_recorded(const Ticket& ticket, Moment now) {
  if (ticket.owner == Ticket::Owner::numbers) {
    recorded_ = reserved_;
    if (std::exchange(out_of_numbers_, false)) {
      reconsider(now);
    }
    finish();
    return;
  }
  step(ticket.key, now,
       [&](channel::ChannelSession& session) { session.on_recorded(ticket.number, now); });
}

void CallControl::on_instance_ready(const fabric::InstanceIdentity& identity, Moment now) {
  carry_out(dispatcher_.on_instance_ready(identity), now);
  reconsider(now);
  finish();
}

void CallControl::on_instance_gone(const fabric::InstanceId& instance, Moment now) {
  carry_out(dispatcher_.on_instance_gone(instance, now.steady), now);
  finish();
}

void CallControl::on_load(const fabric::InstanceLoad& load, Moment now) {
  carry_out(dispatcher_.on_load(load, now.steady), now);
  finish();
}

void CallControl::on_reply(const fabric::Reply& reply, Moment now) {
  // A reply for a channel that no machine of ours has belongs to another gateway.
  if (channel::ChannelSession* session = find(reply.key)) {
    session->on_reply(reply, now);
    follow(*session, now);
  }
  finish();
}

bool CallControl::answering() const {
  return std::ranges::any_of(sessions_, [](const auto& one) {
    return one.second.status().state == fabric::ChannelState::answering;
  });
}

void CallControl::on_time(Moment now) {
  const std::size_t known = dispatcher_.known();
  carry_out(dispatcher_.on_time(now.steady), now);
  if (dispatcher_.known() != known) {
    // Why a request is left alone may be another reason now.
    reconsider(now);
  }
  dispose(context_.answered.due(now.steady));
  for (const fabric::ChannelKey& key : timers_.take_due(now.steady)) {
    channel::ChannelSession& session = *index_.at(key);
    session.on_wake(now);
    follow(session, now);
  }
  finish();
}

std::optional<SteadyTime> CallControl::next_time() const {
  std::optional<SteadyTime> first;
  for (const auto& one : {dispatcher_.next_time(), context_.answered.next_time(), timers_.next()}) {
    if (one && (!first || *one < *first)) {
      first = one;
    }
  }
  return first;
}

channel::ChannelSession* CallControl::find(const fabric::ChannelKey& key) {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : found->second;
}

void CallControl::follow(channel::ChannelSession& session, Moment now) {
  const channel::ChannelNews news = session.take_news();
  if (news.wake_at) {
    timers_.set(session.key(), *news.wake_at);
  }
  if (news.reads && !inherited_.empty()) {
    look_at_inherited(session.key());
  }
  if (news.published) {
    dispatcher_.on_published(*news.published, now.steady);
  }
  if (news.resumed) {
    carry_out(dispatcher_.resume(*session.call(), now.steady), now);
  }
  if (news.declined) {
    carry_out(dispatcher_.decline(*news.declined, now.steady), now);
  }
  if (news.freed) {
    if (news.freed->written) {
      // What the program asks next is new. Whatever else is left here came after this call.
      forget_inherited(session.key(), news.freed->call);
    }
    carry_out(dispatcher_.remove(news.freed->call), now);
  }
  if (news.found) {
    answer_found(session, now);
  }
  context_.standing.note(session.status(), obstacle_.empty(), now);
}

void CallControl::dispose(const std::vector<fabric::RequestKey>& requests) {
  for (const fabric::RequestKey& request : requests) {
    context_.port.dispose(request);
  }
}

void CallControl::carry_out(const dispatch::Decisions& decisions, Moment now) {
  for (const dispatch::Decision& decision : decisions) {
    if (const auto* give = std::get_if<dispatch::Give>(&decision)) {
      channel::ChannelSession& session = *index_.at(give->key);
      session.assign(give->assignment, now);
      follow(session, now);
    } else if (const auto* back = std::get_if<dispatch::TakeBack>(&decision)) {
      channel::ChannelSession& session = *index_.at(back->key);
      session.suspend(back->reason, back->held, now);
      follow(session, now);
    } else if (const auto* explain = std::get_if<dispatch::Explain>(&decision)) {
      channel::ChannelSession& session = *index_.at(explain->key);
      session.explain(explain->reason, now);
      follow(session, now);
    }
  }
}

}  // namespace millrace::gateway::control
