// What happens to a call that no service answers: the configured rules, and the operator.
#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "gateway/channel/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

/// "30 s", "1.5 s"
std::string seconds(std::chrono::milliseconds time) {
  return fmt::format("{:g} s", std::chrono::duration<double>(time).count());
}

bool over(const std::optional<Rule>& rule, SteadyTime since, Moment now) {
  return rule && now.steady - since >= rule->after;
}

}  // namespace

Actions ChannelSession::settle(const Settlement& settlement, Moment now) {
  if (active_ && !active_->call.answer) {
    answer_instead(settlement, now);
  }
  return finish(now);
}

Actions ChannelSession::retry(const std::string& by, Moment now) {
  if (active_ && !active_->call.answer) {
    active_->assignment.reset();
    active_->dispatch_ticket = 0;
    active_->held = false;
    active_->reason = fmt::format("given out again by {}", by);
    say(Level::info, fmt::format("call {}: {}", active_->call.id.to_string(), active_->reason));
  }
  return finish(now);
}

void ChannelSession::check_patience(Moment now) {
  if (!active_) {
    if (!retired_ && watch_.ignored() && !out_of_patience_ &&
        over(policy_.unserved, left_at_, now)) {
      // Read once more and offered with the note that its time is up.
      out_of_patience_ = true;
      watch_.reconsider();
      due_ = now.steady;
    }
    return;
  }
  Active& active = *active_;
  if (active.call.answer || !active.verified) {
    return;
  }
  if (active.lost_since && !active.lost_told && over(policy_.lost, *active.lost_since, now)) {
    active.lost_told = true;
    give_up(*policy_.lost, "its instance is lost, and it must not run twice", now);
  } else if (!active.overdue && over(policy_.deadline, active.since, now)) {
    active.overdue = true;
    give_up(*policy_.deadline, fmt::format("no answer within {}", seconds(policy_.deadline->after)),
            now);
  }
}

void ChannelSession::give_up(const Rule& rule, const std::string& why, Moment now) {
  if (rule.response_state != 0) {
    answer_instead({fmt::format("millrace: {}", why), rule.response_state, "the gateway"}, now);
    return;
  }
  active_->reason = fmt::format("{}; the program waits on", why);
  tell(fabric::EventKind::late, active_->reason, now);
  say(Level::warn, fmt::format("call {}: {}", active_->call.id.to_string(), active_->reason));
}

void ChannelSession::answer_instead(const Settlement& settlement, Moment now) {
  Active& active = *active_;
  Call& call = active.call;
  if (call.attempts.empty()) {
    // Opens the call in the journal; nobody was asked.
    record(DispatchedEntry{call.id, key_, call.request, call.seen, call.delivery, 0, {}});
  }
  Answer answer;
  answer.attempt = call.attempts.empty() ? 0 : call.attempts.back().number;
  answer.text = settlement.text;
  answer.state = settlement.state;
  fabric::Event event;
  event.detail = fmt::format("answered by {}", settlement.by);
  say(Level::warn, fmt::format("call {} is answered by {} with state {}: {}", call.id.to_string(),
                               settlement.by, settlement.state, printable(settlement.text)));
  take_answer(std::move(answer), std::move(event), now);
}

}  // namespace millrace::gateway::channel
