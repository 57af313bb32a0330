#include "gateway/control/call_control.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace millrace::gateway::control {

CallControl::CallControl(CallControlOptions options, const journal::Ledger& ledger)
    : options_(std::move(options)),
      dispatcher_(options_.dispatcher),
      epoch_(ledger.numbers().epoch),
      last_number_(ledger.numbers().reserved),
      recorded_(ledger.numbers().reserved),
      reserved_(ledger.numbers().reserved) {
  assert(epoch_ != 0);
  standing_ = ledger.standing();
  for (const Call& call : ledger.open_calls()) {
    open(call.key).resume(call, policy_of(call.key, fabric::canonical_uuid(call.request.uuid)));
  }
}

template <typename Step>
ChannelActions CallControl::step(const fabric::ChannelKey& key, Moment now, Step step) {
  if (channel::ChannelSession* session = find(key)) {
    run(*session, step(*session), now);
  }
  return finish();
}

ChannelActions CallControl::set_told(const fabric::ChannelKey& key, bool told, Moment now) {
  return step(key, now,
              [&](channel::ChannelSession& session) { return session.set_told(told, now); });
}

ChannelActions CallControl::on_change(const fabric::ChannelKey& key, Variable variable,
                                      Moment now) {
  return step(key, now,
              [&](channel::ChannelSession& session) { return session.on_change(variable, now); });
}

ChannelActions CallControl::on_read(const fabric::ChannelKey& key, const Snapshot& snapshot,
                                    Moment now) {
  if (!inherited_.empty() && snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    forget_looked_at(key);
  }
  if (snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    forget_standing(key);
  }
  return step(key, now,
              [&](channel::ChannelSession& session) { return session.on_read(snapshot, now); });
}

ChannelActions CallControl::on_read_failed(const fabric::ChannelKey& key, const std::string& reason,
                                           Moment now) {
  return step(key, now, [&](channel::ChannelSession& session) {
    return session.on_read_failed(reason, now);
  });
}

ChannelActions CallControl::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                                     const std::string& reason, Moment now) {
  return step(key, now, [&](channel::ChannelSession& session) {
    return session.on_write(outcome, reason, now);
  });
}

ChannelActions CallControl::on_recorded(const Ticket& ticket, Moment now) {
  if (ticket.owner == Ticket::Owner::numbers) {
    recorded_ = reserved_;
    if (std::exchange(out_of_numbers_, false)) {
      reconsider(now);
    }
    return finish();
  }
  return step(ticket.key, now, [&](channel::ChannelSession& session) {
    return session.on_recorded(ticket.number, now);
  });
}

ChannelActions CallControl::on_instance_ready(const fabric::InstanceIdentity& identity,
                                              Moment now) {
  carry_out(dispatcher_.on_instance_ready(identity), now);
  reconsider(now);
  return finish();
}

ChannelActions CallControl::on_instance_gone(const fabric::InstanceId& instance, Moment now) {
  carry_out(dispatcher_.on_instance_gone(instance, now.steady), now);
  return finish();
}

ChannelActions CallControl::on_load(const fabric::InstanceLoad& load, Moment now) {
  carry_out(dispatcher_.on_load(load, now.steady), now);
  return finish();
}

ChannelActions CallControl::on_reply(const fabric::Reply& reply, Moment now) {
  // A reply for a channel that no machine of ours has belongs to another gateway.
  if (channel::ChannelSession* session = find(reply.key)) {
    run(*session, session->on_reply(reply, now), now);
  }
  return finish();
}

bool CallControl::answering() const {
  return std::ranges::any_of(sessions_, [](const auto& one) {
    return one.second.status().state == fabric::ChannelState::answering;
  });
}

ChannelActions CallControl::on_time(Moment now) {
  const std::size_t known = dispatcher_.known();
  carry_out(dispatcher_.on_time(now.steady), now);
  if (dispatcher_.known() != known) {
    // Why a request is left alone may be another reason now.
    reconsider(now);
  }
  withdraw(answered_.due(now.steady));
  for (const fabric::ChannelKey& key : timers_.take_due(now.steady)) {
    channel::ChannelSession& session = *index_.at(key);
    run(session, session.on_wake(now), now);
  }
  return finish();
}

std::optional<SteadyTime> CallControl::next_time() const {
  std::optional<SteadyTime> first;
  for (const auto& one : {dispatcher_.next_time(), answered_.next_time(), timers_.next()}) {
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

void CallControl::run(channel::ChannelSession& session, SessionActions actions, Moment now) {
  for (SessionAction& wanted : actions) {
    if (auto* action = std::get_if<Action>(&wanted)) {
      pass_on(session, std::move(*action), now);
    } else if (const auto* offer = std::get_if<Offer>(&wanted)) {
      answer_offer(session, *offer, now);
    } else if (std::holds_alternative<Resume>(wanted)) {
      carry_out(dispatcher_.resume(*session.call(), now.steady), now);
    } else if (const auto* freed = std::get_if<Freed>(&wanted)) {
      if (freed->written) {
        // What the program asks next is new. Whatever else is left here came after this call.
        forget_inherited(session.key(), freed->call);
      }
      carry_out(dispatcher_.remove(freed->call), now);
    } else if (const auto* left = std::get_if<LeaveBe>(&wanted)) {
      answered_.keep({session.key(), epoch_, left->instance}, now.steady);
    } else if (const auto* wake = std::get_if<WakeAt>(&wanted)) {
      timers_.set(session.key(), wake->at);
    } else if (const auto* declined = std::get_if<Declined>(&wanted)) {
      carry_out(dispatcher_.decline(declined->call, now.steady), now);
    }
  }
  note_standing(session, now);
  constexpr std::size_t most_spare = 16;
  if (actions.capacity() != 0 && commons_.spare.size() < most_spare) {
    actions.clear();
    commons_.spare.push_back(std::move(actions));
  }
}

void CallControl::recycle(ChannelActions actions) {
  if (out_.capacity() == 0) {
    actions.clear();
    out_ = std::move(actions);
  }
}

void CallControl::withdraw(const std::vector<fabric::RequestKey>& requests) {
  for (const fabric::RequestKey& request : requests) {
    out_.push_back({request.key, Withdraw{request.instance, request.epoch}});
  }
}

void CallControl::note_standing(const channel::ChannelSession& session, Moment now) {
  using enum fabric::ChannelState;
  const fabric::ChannelStatus& status = session.status();
  if (status.state == held || status.state == unserved) {
    // A journal that is full says so itself, and is no place for this.
    if (standing_of(status) == nullptr && obstacle_.empty()) {
      StandingEntry entry{.key = session.key(),
                          .state = status.state,
                          .call = status.call,
                          .uuid = status.uuid,
                          .since = now.wall,
                          .reason = status.reason};
      standing_.insert_or_assign(session.key(), entry);
      out_.push_back({session.key(), Record{{}, std::move(entry)}});
    }
  } else if (const auto found = standing_.find(session.key()); found != standing_.end() &&
                                                               status.call != fabric::CallId{} &&
                                                               status.call != found->second.call) {
    forget_standing(session.key());
  }
}

void CallControl::forget_standing(const fabric::ChannelKey& key) {
  if (!standing_.empty() && standing_.erase(key) != 0) {
    out_.push_back({key, Record{{}, StandingEntry{.key = key}}});
  }
}

const StandingEntry* CallControl::standing_of(const fabric::ChannelStatus& status) const {
  const auto found = standing_.find(status.key);
  const bool same = found != standing_.end() && found->second.state == status.state &&
                    found->second.call == status.call && found->second.uuid == status.uuid;
  return same ? &found->second : nullptr;
}

void CallControl::pass_on(const channel::ChannelSession& session, Action action, Moment now) {
  if (auto* next = std::get_if<Publish>(&action)) {
    answered_.replace(key_of(next->request));
    dispatcher_.on_published(next->request.call, now.steady);
    if (const auto before = predecessors_.find(session.key()); before != predecessors_.end()) {
      next->request.succeeds = before->second;
    }
  } else if (const auto* old = std::get_if<Withdraw>(&action)) {
    answered_.replace({session.key(), old->epoch, old->instance});
  } else if (std::holds_alternative<Read>(action) && !inherited_.empty()) {
    look_at_inherited(session.key());
  } else if (auto* show = std::get_if<Show>(&action); show != nullptr && !standing_.empty()) {
    if (const StandingEntry* standing = standing_of(show->status)) {
      show->status.since = standing->since;
      if (standing->state == fabric::ChannelState::held) {
        // Who was lost with it only the one that saw it can name.
        show->status.reason = standing->reason;
      }
    }
  }
  out_.push_back({session.key(), std::move(action)});
}

void CallControl::carry_out(const dispatch::Decisions& decisions, Moment now) {
  for (const dispatch::Decision& decision : decisions) {
    if (const auto* give = std::get_if<dispatch::Give>(&decision)) {
      channel::ChannelSession& session = *index_.at(give->key);
      run(session, session.assign(give->assignment, now), now);
    } else if (const auto* back = std::get_if<dispatch::TakeBack>(&decision)) {
      channel::ChannelSession& session = *index_.at(back->key);
      run(session, session.suspend(back->reason, back->held, now), now);
    } else if (const auto* explain = std::get_if<dispatch::Explain>(&decision)) {
      channel::ChannelSession& session = *index_.at(explain->key);
      run(session, session.explain(explain->reason, now), now);
    }
  }
}

}  // namespace millrace::gateway::control
