// What the steps of a channel mean for calls, and what becomes of a request that was found: left as
// it is, accepted under a new number, held for an operator, or settled here.
#include <algorithm>
#include <string>

#include <fmt/format.h>

#include "fabric/cases.hpp"
#include "fabric/channel_scope.hpp"
#include "gateway/core/core.hpp"

namespace millrace::gateway::core {

void Core::read_channel(const fabric::ChannelKey& key, const Snapshot& snapshot) {
  if (snapshot.has(Variable::request_state) && snapshot.request_state == 0) {
    predecessors_.on_zero_read(key);
    context_.standing.forget(key);
  }
  step(key, [&](channel::ChannelSession& session) { session.on_read(snapshot, now_); });
}

void Core::follow(channel::ChannelSession& session) {
  const channel::ChannelNews news = session.take_news();
  if (news.wake_at) {
    timers_.set(session.key(), *news.wake_at);
  }
  if (news.reads) {
    predecessors_.on_read_started(session.key());
  }
  if (news.published) {
    dispatcher_.on_published(*news.published, now_.steady);
  }
  if (news.resumed) {
    apply(dispatcher_.resume(*session.call(), now_.steady));
  }
  if (news.declined) {
    apply(dispatcher_.decline(*news.declined, now_.steady));
  }
  if (news.freed) {
    if (news.freed->written) {
      // Whatever else a predecessor has left here came after this call.
      predecessors_.on_answered(session.key(), news.freed->call);
    }
    apply(dispatcher_.remove(news.freed->call));
  }
  if (news.found) {
    admit(session);
  }
  context_.standing.note(session.status(), obstacle_.empty(), now_);
}

void Core::apply(const dispatch::Decisions& decisions) {
  for (const dispatch::Decision& decision : decisions) {
    std::visit(fabric::Cases{[&](const dispatch::Give& give) {
                               channel::ChannelSession& session = *index_.at(give.key);
                               session.assign(give.assignment, now_);
                               follow(session);
                             },
                             [&](const dispatch::TakeBack& back) {
                               channel::ChannelSession& session = *index_.at(back.key);
                               session.suspend(back.reason, back.held, now_);
                               follow(session);
                             },
                             [&](const dispatch::Explain& explain) {
                               channel::ChannelSession& session = *index_.at(explain.key);
                               session.explain(explain.reason, now_);
                               follow(session);
                             }},
               decision);
  }
}

void Core::admit(channel::ChannelSession& session) {
  const std::string uuid = fabric::canonical_uuid(session.found().uuid);
  const Policy policy = policy_of(session.key(), uuid);
  if (!obstacle_.empty()) {
    session.leave(obstacle_, policy, now_);
    follow(session);
    return;
  }
  const auto unserved = dispatcher_.serves(uuid, session.key())
                            ? std::nullopt
                            : dispatcher_.why_unserved(session.found().uuid, session.key());
  const bool settled_here = unserved && session.out_of_patience() && policy.unserved &&
                            policy.unserved->response_state != 0;
  if ((!unserved || settled_here) && numbers_.used_up()) {
    out_of_numbers_ = true;
    session.leave("the journal has not confirmed new call numbers yet; the call waits for it",
                  policy, now_);
    follow(session);
    return;
  }
  if (!unserved && hold_for_predecessor(session, uuid, policy)) {
    return;
  }
  if (!unserved) {
    session.claim(next_id(), policy, now_);
    follow(session);
    apply(dispatcher_.add(*session.call()));
  } else if (settled_here) {
    session.claim(next_id(), policy, now_);
    follow(session);
    const auto answer =
        Response::in_words("millrace: served by nobody", policy.unserved->response_state);
    session.settle({answer, "the gateway"}, now_);
    follow(session);
  } else {
    session.leave(*unserved, policy, now_);
    follow(session);
  }
}

bool Core::hold_for_predecessor(channel::ChannelSession& session, const std::string& canonical_uuid,
                                const Policy& policy) {
  const auto predecessor = predecessors_.take(session.key(), canonical_uuid);
  if (!predecessor || dispatcher_.delivery_of(canonical_uuid) != fabric::Delivery::at_most_once) {
    return false;
  }
  session.claim(next_id(), policy, now_);
  follow(session);
  session.hold(fmt::format("{}, which is gone, may have given this call out; it must not run "
                           "twice: an operator must answer or retry it",
                           predecessor->from),
               now_);
  follow(session);
  return true;
}

Policy Core::policy_of(const fabric::ChannelKey& key, const std::string& canonical_uuid) const {
  return options_.policies.of(std::string(fabric::machine_of(key.machine)), canonical_uuid);
}

void Core::offer_again() {
  for (auto& [key, session] : sessions_) {
    session.reconsider(now_);
    follow(session);
  }
}

void Core::stop_accepting(const std::string& reason) {
  obstacle_ = reason;
  if (obstacle_.empty()) {
    offer_again();
  }
}

fabric::CallId Core::next_id() {
  const fabric::CallId id = numbers_.take();
  reserve_numbers();
  return id;
}

void Core::reserve_numbers() {
  if (const auto entry = numbers_.reserve()) {
    host_.append(*entry, {.owner = Ticket::Owner::numbers});
  }
}

bool Core::answering() const {
  return std::ranges::any_of(sessions_, [](const auto& one) {
    return one.second.status().state == fabric::ChannelState::answering;
  });
}

}  // namespace millrace::gateway::core
