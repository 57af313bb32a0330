#include "gateway/core.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

namespace millrace::gateway {

namespace {

/// Numbers reserved in the journal at once; a restart goes on behind the block. The next block is
/// asked for when half of it is used, so that no call waits for the disk.
constexpr std::uint64_t block = 1000;

/// Of the records that reserve numbers; a session counts its own from 1.
constexpr std::uint64_t numbers_ticket = ~std::uint64_t{0};

}  // namespace

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

ChannelActions Core::on_link_up(const std::string& machine,
                                const std::vector<std::uint16_t>& channels, Moment now) {
  for (const std::uint16_t channel : channels) {
    reserve_numbers({machine, channel});
    ChannelSession& session = open({machine, channel});
    if (session.retired()) {
      leaving_.erase(session.key());
      run(session, session.keep(now), now);
    }
    if (!session.link_up()) {
      run(session, session.on_link_up(now), now);
    }
  }
  for (const fabric::ChannelKey& key : leaving_) {
    ChannelSession& session = sessions_.at(key);
    if (key.machine == machine && !session.link_up()) {
      run(session, session.on_link_up(now), now);
    }
  }
  return finish();
}

ChannelActions Core::on_link_down(const std::string& machine, const std::string& reason,
                                  Moment now) {
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      run(session, session.on_link_down(reason, now), now);
    }
  }
  return finish();
}

ChannelActions Core::on_link_dropped(const std::string& machine, const std::string& reason,
                                     Moment now) {
  for (auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      // Another gateway may serve the channel by now.
      leftovers_.take(key);
      run(session, session.on_link_dropped(reason, now), now);
    }
  }
  return finish();
}

ChannelActions Core::retire(const fabric::ChannelKey& key, Moment now) {
  if (ChannelSession* session = find(key)) {
    leaving_.insert(key);
    run(*session, session->retire(now), now);
  }
  return finish();
}

ChannelActions Core::release(const fabric::ChannelKey& key, const std::string& reason, Moment now) {
  if (ChannelSession* session = find(key)) {
    leaving_.insert(key);
    // Taken back now, it would take the other's request of the same channel with it.
    leftovers_.take(key);
    if (session->may_be_given()) {
      // The other may never take it up before we serve the channel again.
      const Call* call = session->call();
      inherit(key, {call->request.uuid, "this gateway, which had left the channel to another one",
                    call->id});
    }
    run(*session, session->release(reason, now), now);
  }
  return finish();
}

void Core::inherit(const fabric::ChannelKey& key, Inheritance inheritance) {
  const std::string uuid = fabric::canonical_uuid(inheritance.uuid);
  inherited_[key].insert_or_assign(uuid, std::move(inheritance));
}

std::vector<std::uint16_t> Core::channels_of(const std::string& machine) const {
  std::vector<std::uint16_t> channels;
  for (const auto& [key, session] : sessions_) {
    if (key.machine == machine) {
      channels.push_back(key.channel);
    }
  }
  return channels;
}

ChannelActions Core::change(std::map<std::string, Pace> paces, Policies policies, Moment now) {
  options_.paces = std::move(paces);
  options_.policies = std::move(policies);
  for (auto& [key, session] : sessions_) {
    session.set_pace(pace_of(key.machine));
  }
  reconsider(now);
  return finish();
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

ChannelActions Core::on_answer(const fabric::ChannelKey& key, const fabric::CallId& call,
                               const Settlement& settlement, Verdict& verdict, Moment now) {
  if (ChannelSession* session = find_pending(key, call, verdict)) {
    run(*session, session->settle(settlement, now), now);
    verdict = {true, "the answer is on its way to the program"};
  }
  return finish();
}

ChannelActions Core::on_retry(const fabric::ChannelKey& key, const fabric::CallId& call,
                              const std::string& by, Verdict& verdict, Moment now) {
  if (ChannelSession* session = find_pending(key, call, verdict)) {
    run(*session, session->retry(by, now), now);
    carry_out(dispatcher_.add(*session->call()), now);
    verdict = {true, session->status().reason};
  }
  return finish();
}

ChannelActions Core::set_obstacle(const std::string& reason, Moment now) {
  obstacle_ = reason;
  if (obstacle_.empty()) {
    reconsider(now);
  }
  return finish();
}

ChannelActions Core::take_back(Moment now) {
  for (auto& [key, session] : sessions_) {
    run(session, session.let_go(now), now);
  }
  for (auto& [key, uuid] : leftovers_.take_all()) {
    out_.push_back({key, Withdraw{std::move(uuid)}});
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
    out_.push_back({key, Withdraw{std::move(uuid)}});
  }
  return finish();
}

std::optional<SteadyTime> Core::next_time() const {
  const auto one = dispatcher_.next_time();
  const auto other = leftovers_.next_time();
  return one && other ? std::min(*one, *other) : one ? one : other;
}

ChannelSession* Core::find(const fabric::ChannelKey& key) {
  const auto found = sessions_.find(key);
  return found == sessions_.end() ? nullptr : &found->second;
}

ChannelSession& Core::open(const fabric::ChannelKey& key) {
  return sessions_.try_emplace(key, key, pace_of(key.machine)).first->second;
}

Pace Core::pace_of(const std::string& machine) const {
  const auto pace = options_.paces.find(machine);
  return pace == options_.paces.end() ? Pace{} : pace->second;
}

void Core::run(ChannelSession& session, Actions actions, Moment now) {
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
          out_.push_back({session.key(), Withdraw{std::move(*old)}});
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
      ChannelSession& session = sessions_.at(give->key);
      run(session, session.assign(give->assignment, now), now);
    } else if (const auto* back = std::get_if<TakeBack>(&decision)) {
      ChannelSession& session = sessions_.at(back->key);
      run(session, session.suspend(back->reason, back->held, now), now);
    } else if (const auto* explain = std::get_if<Explain>(&decision)) {
      ChannelSession& session = sessions_.at(explain->key);
      run(session, session.explain(explain->reason, now), now);
    }
  }
}

void Core::answer_offer(ChannelSession& session, const Offer& offer, Moment now) {
  const Policy policy = policy_of(session.key(), offer.request.uuid);
  if (!obstacle_.empty()) {
    run(session, session.leave(obstacle_, policy, now), now);
    return;
  }
  const auto unserved = dispatcher_.why_unserved(offer.request.uuid, session.key());
  const bool settled_here =
      unserved && offer.out_of_patience && policy.unserved && policy.unserved->response_state != 0;
  if ((!unserved || settled_here) && last_number_ == recorded_) {
    out_of_numbers_ = true;
    run(session,
        session.leave("the journal has not confirmed new call numbers yet; the call waits for it",
                      policy, now),
        now);
    return;
  }
  if (!unserved && hold_inherited(session, offer, policy, now)) {
    return;
  }
  if (!unserved) {
    run(session, session.claim(next_id(session.key()), policy, now), now);
    carry_out(dispatcher_.add(*session.call()), now);
  } else if (settled_here) {
    run(session, session.claim(next_id(session.key()), policy, now), now);
    const Settlement settlement{"millrace: served by nobody", policy.unserved->response_state,
                                "the gateway"};
    run(session, session.settle(settlement, now), now);
  } else {
    run(session, session.leave(*unserved, policy, now), now);
  }
}

void Core::forget_inherited(const fabric::ChannelKey& key, const fabric::CallId& call) {
  if (const auto found = inherited_.find(key); found != inherited_.end()) {
    std::erase_if(found->second, [&](const auto& one) { return one.second.call == call; });
  }
}

bool Core::hold_inherited(ChannelSession& session, const Offer& offer, const Policy& policy,
                          Moment now) {
  auto inherited = inherited_.extract(session.key());
  const std::string uuid = fabric::canonical_uuid(offer.request.uuid);
  if (inherited.empty() || !inherited.mapped().contains(uuid) ||
      dispatcher_.delivery_of(uuid) != fabric::Delivery::at_most_once) {
    return false;
  }
  run(session, session.claim(next_id(session.key()), policy, now), now);
  run(session,
      session.hold(fmt::format("{}, which is gone, may have given this call out; it must not run "
                               "twice: an operator must answer or retry it",
                               inherited.mapped().at(uuid).from),
                   now),
      now);
  return true;
}

ChannelSession* Core::find_pending(const fabric::ChannelKey& key, const fabric::CallId& call,
                                   Verdict& verdict) {
  ChannelSession* session = find(key);
  if (session == nullptr || session->call() == nullptr) {
    verdict = {false, "no call is pending on this channel"};
    return nullptr;
  }
  if (session->call()->id != call) {
    verdict = {false, "another call is pending by now: " + session->call()->id.to_string()};
    return nullptr;
  }
  if (session->call()->answer) {
    verdict = {false, "the call's answer is being written"};
    return nullptr;
  }
  return session;
}

Policy Core::policy_of(const fabric::ChannelKey& key, const std::string& uuid) const {
  return options_.policies.of(key.machine, fabric::canonical_uuid(uuid));
}

void Core::reconsider(Moment now) {
  for (auto& [key, session] : sessions_) {
    run(session, session.reconsider(now), now);
  }
}

fabric::CallId Core::next_id(const fabric::ChannelKey& key) {
  assert(last_number_ < recorded_);
  ++last_number_;
  reserve_numbers(key);
  return {epoch_, last_number_};
}

void Core::reserve_numbers(const fabric::ChannelKey& key) {
  if (reserved_ == recorded_ && reserved_ - last_number_ < block / 2) {
    reserved_ += block;
    out_.push_back({key, Record{numbers_ticket, journal::Numbers{epoch_, reserved_}}});
  }
}

ChannelActions Core::finish() {
  for (auto it = leaving_.begin(); it != leaving_.end();) {
    if (sessions_.at(*it).is_over()) {
      if (auto old = leftovers_.take(*it)) {
        out_.push_back({*it, Withdraw{std::move(*old)}});
      }
      out_.push_back({*it, Hide{}});
      sessions_.erase(*it);
      it = leaving_.erase(it);
    } else {
      ++it;
    }
  }
  return std::exchange(out_, {});
}

}  // namespace millrace::gateway
