#include "gateway/core.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace millrace::gateway {

Core::Core(CoreOptions options, const journal::Ledger& ledger)
    : options_(std::move(options)),
      dispatcher_(options_.dispatcher),
      epoch_(ledger.numbers().epoch),
      last_number_(ledger.numbers().reserved),
      recorded_(ledger.numbers().reserved),
      reserved_(ledger.numbers().reserved) {
  assert(epoch_ != 0);
  for (const Call& call : ledger.open_calls()) {
    open(call.key).resume(call, policy_of(call.key, call.request.uuid));
  }
}

template <typename Step>
ChannelActions Core::step(const fabric::ChannelKey& key, Moment now, Step step) {
  if (ChannelSession* session = find(key)) {
    run(*session, step(*session), now);
  }
  return finish();
}

ChannelActions Core::on_wake(const fabric::ChannelKey& key, Moment now) {
  return step(key, now, [&](ChannelSession& session) { return session.on_wake(now); });
}

ChannelActions Core::on_read(const fabric::ChannelKey& key, const Picture& picture, Moment now) {
  if (!inherited_.empty() && picture.has(Variable::request_state) && picture.request_state == 0) {
    inherited_.erase(key);
  }
  return step(key, now, [&](ChannelSession& session) { return session.on_read(picture, now); });
}

ChannelActions Core::on_read_failed(const fabric::ChannelKey& key, const std::string& reason,
                                    Moment now) {
  return step(key, now,
              [&](ChannelSession& session) { return session.on_read_failed(reason, now); });
}

ChannelActions Core::on_write(const fabric::ChannelKey& key, WriteOutcome outcome,
                              const std::string& reason, Moment now) {
  return step(key, now,
              [&](ChannelSession& session) { return session.on_write(outcome, reason, now); });
}

ChannelActions Core::on_recorded(const fabric::ChannelKey& key, std::uint64_t ticket, Moment now) {
  if (ticket == numbers_ticket) {
    recorded_ = reserved_;
    if (std::exchange(out_of_numbers_, false)) {
      reconsider(now);
    }
    return finish();
  }
  return step(key, now, [&](ChannelSession& session) { return session.on_recorded(ticket, now); });
}

ChannelActions Core::on_instance_ready(const fabric::InstanceIdentity& identity, Moment now) {
  carry_out(dispatcher_.on_instance_ready(identity), now);
  reconsider(now);
  return finish();
}

ChannelActions Core::on_instance_gone(const fabric::InstanceId& instance, Moment now) {
  carry_out(dispatcher_.on_instance_gone(instance, now.steady), now);
  return finish();
}

ChannelActions Core::on_reply(const fabric::Reply& reply, Moment now) {
  // A reply for a channel that no machine of ours has belongs to another gateway.
  if (ChannelSession* session = find(reply.key)) {
    run(*session, session->on_reply(reply, now), now);
  }
  return finish();
}

bool Core::answering() const {
  return std::ranges::any_of(sessions_, [](const auto& one) {
    return one.second.status().state == fabric::ChannelState::answering;
  });
}

ChannelActions Core::on_time(Moment now) {
  carry_out(dispatcher_.on_time(now.steady), now);
  for (auto& [key, uuid] : leftovers_.due(now.steady)) {
    out_.push_back({key, Withdraw{std::move(uuid), epoch_}});
  }
  return finish();
}

std::optional<SteadyTime> Core::next_time() const {
  const auto one = dispatcher_.next_time();
  const auto other = leftovers_.next_time();
  return one && other ? std::min(*one, *other) : one ? one : other;
}

ChannelSession* Core::find(const fabric::ChannelKey& key) {
  const auto found = index_.find(key);
  return found == index_.end() ? nullptr : found->second;
}

void Core::run(ChannelSession& session, Actions actions, Moment now) {
  if (out_.capacity() == 0) {
    out_.reserve(few_actions);
  }
  for (Action& action : actions) {
    if (const auto* offer = std::get_if<Offer>(&action)) {
      answer_offer(session, *offer, now);
    } else if (std::holds_alternative<Resume>(action)) {
      carry_out(dispatcher_.resume(*session.call(), now.steady), now);
    } else if (const auto* freed = std::get_if<Freed>(&action)) {
      carry_out(dispatcher_.remove(freed->call), now);
    } else if (const auto* left = std::get_if<LeaveBe>(&action)) {
      leftovers_.keep(session.key(), left->uuid, now.steady);
    } else {
      if (const auto* next = std::get_if<Publish>(&action)) {
        if (auto old = leftovers_.replace(session.key(), next->request.uuid)) {
          out_.push_back({session.key(), Withdraw{std::move(*old), epoch_}});
        }
      }
      const auto* tell = std::get_if<Tell>(&action);
      if (tell != nullptr && tell->event.kind == fabric::EventKind::written) {
        // What the program asks next is new. Whatever else is left here came after this call.
        forget_inherited(session.key(), tell->event.call);
      }
      out_.push_back({session.key(), std::move(action)});
    }
  }
}

void Core::carry_out(const Decisions& decisions, Moment now) {
  for (const Decision& decision : decisions) {
    if (const auto* give = std::get_if<Give>(&decision)) {
      ChannelSession& session = *index_.at(give->key);
      run(session, session.assign(give->assignment, now), now);
    } else if (const auto* back = std::get_if<TakeBack>(&decision)) {
      ChannelSession& session = *index_.at(back->key);
      run(session, session.suspend(back->reason, back->held, now), now);
    } else if (const auto* explain = std::get_if<Explain>(&decision)) {
      ChannelSession& session = *index_.at(explain->key);
      run(session, session.explain(explain->reason, now), now);
    }
  }
}

}  // namespace millrace::gateway
