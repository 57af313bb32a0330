// What becomes of a request that a session found: left as it is, claimed under a new number,
// held for an operator, or settled here.
#include <cassert>
#include <string>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/control/call_control.hpp"

namespace millrace::gateway::control {

namespace {

/// Numbers reserved in the journal at once; a restart goes on behind the block. The next block is
/// asked for when half of it is used, so that no call waits for the disk.
constexpr std::uint64_t block = 1000;

}  // namespace

void CallControl::set_obstacle(const std::string& reason, Moment now) {
  obstacle_ = reason;
  if (obstacle_.empty()) {
    reconsider(now);
  }
  finish();
}

void CallControl::set_journal_trouble(const std::string& reason, Moment now) {
  context_.journal_trouble = reason;
  for (auto& [key, session] : sessions_) {
    session.show_again(now);
    follow(session, now);
  }
  set_obstacle(reason, now);
}

void CallControl::answer_found(channel::ChannelSession& session, Moment now) {
  const std::string uuid = fabric::canonical_uuid(session.found().uuid);
  const Policy policy = policy_of(session.key(), uuid);
  if (!obstacle_.empty()) {
    session.leave(obstacle_, policy, now);
    follow(session, now);
    return;
  }
  const auto unserved = dispatcher_.serves(uuid, session.key())
                            ? std::nullopt
                            : dispatcher_.why_unserved(session.found().uuid, session.key());
  const bool settled_here = unserved && session.out_of_patience() && policy.unserved &&
                            policy.unserved->response_state != 0;
  if ((!unserved || settled_here) && last_number_ == recorded_) {
    out_of_numbers_ = true;
    session.leave("the journal has not confirmed new call numbers yet; the call waits for it",
                  policy, now);
    follow(session, now);
    return;
  }
  if (!unserved && hold_inherited(session, uuid, policy, now)) {
    return;
  }
  if (!unserved) {
    session.claim(next_id(), policy, now);
    follow(session, now);
    carry_out(dispatcher_.add(*session.call()), now);
  } else if (settled_here) {
    session.claim(next_id(), policy, now);
    follow(session, now);
    const auto answer =
        Response::in_words("millrace: served by nobody", policy.unserved->response_state);
    session.settle({answer, "the gateway"}, now);
    follow(session, now);
  } else {
    session.leave(*unserved, policy, now);
    follow(session, now);
  }
}

bool CallControl::hold_inherited(channel::ChannelSession& session,
                                 const std::string& canonical_uuid, const Policy& policy,
                                 Moment now) {
  const auto inherited = inherited_.find(session.key());
  if (inherited == inherited_.end()) {
    return false;
  }
  const auto asked = inherited->second.extract(canonical_uuid);
  forget_looked_at(session.key());
  if (asked.empty() || dispatcher_.delivery_of(canonical_uuid) != fabric::Delivery::at_most_once) {
    return false;
  }
  session.claim(next_id(), policy, now);
  follow(session, now);
  session.hold(fmt::format("{}, which is gone, may have given this call out; it must not run "
                           "twice: an operator must answer or retry it",
                           asked.mapped().from),
               now);
  follow(session, now);
  return true;
}

void CallControl::look_at_inherited(const fabric::ChannelKey& key) {
  if (const auto found = inherited_.find(key); found != inherited_.end()) {
    for (auto& [uuid, inheritance] : found->second) {
      inheritance.looked_since = true;
    }
  }
}

void CallControl::forget_looked_at(const fabric::ChannelKey& key) {
  if (const auto found = inherited_.find(key); found != inherited_.end()) {
    std::erase_if(found->second, [](const auto& one) { return one.second.looked_since; });
    if (found->second.empty()) {
      inherited_.erase(found);
    }
  }
}

void CallControl::forget_inherited(const fabric::ChannelKey& key, const fabric::CallId& call) {
  if (const auto found = inherited_.find(key); found != inherited_.end()) {
    std::erase_if(found->second, [&](const auto& one) { return one.second.call == call; });
    if (found->second.empty()) {
      inherited_.erase(found);
    }
  }
}

Policy CallControl::policy_of(const fabric::ChannelKey& key,
                              const std::string& canonical_uuid) const {
  return options_.policies.of(std::string(fabric::machine_of(key.machine)), canonical_uuid);
}

void CallControl::reconsider(Moment now) {
  for (auto& [key, session] : sessions_) {
    session.reconsider(now);
    follow(session, now);
  }
}

fabric::CallId CallControl::next_id() {
  assert(last_number_ < recorded_);
  ++last_number_;
  reserve_numbers();
  return {epoch_, last_number_};
}

void CallControl::reserve_numbers() {
  if (reserved_ == recorded_ && reserved_ - last_number_ < block / 2) {
    reserved_ += block;
    context_.port.record(NumbersEntry{epoch_, reserved_}, {.owner = Ticket::Owner::numbers});
  }
}

}  // namespace millrace::gateway::control
