// What people and tools see of a channel: status, events, log.
#include <tuple>
#include <utility>

#include "gateway/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway {

namespace {

bool same(const fabric::ChannelStatus& a, const fabric::ChannelStatus& b) {
  const auto all = [](const fabric::ChannelStatus& s) {
    return std::tie(s.state, s.call, s.attempt, s.instance, s.uuid, s.reason, s.calls, s.answered,
                    s.withdrawn, s.repeated, s.late, s.failed);
  };
  return all(a) == all(b);
}

}  // namespace

void ChannelSession::tell(fabric::EventKind kind, const std::string& detail, Moment now) {
  fabric::Event event;
  event.kind = kind;
  event.detail = detail;
  if (active_) {
    const Call& call = active_->call;
    event.call = call.id;
    event.uuid = call.request.uuid;
    if (!call.attempts.empty()) {
      event.attempt = call.attempts.back().number;
      event.instance = call.attempts.back().instance;
    }
    if (kind == fabric::EventKind::seen) {
      event.text = call.request.text;
      event.state = call.request.state;
    } else if (kind == fabric::EventKind::written && call.answer) {
      event.attempt = call.answer->attempt;
      event.instance = call.answer->instance;
      event.text = call.answer->text;
      event.state = call.answer->state;
    }
  }
  tell(std::move(event), now);
}

void ChannelSession::tell(fabric::Event event, Moment now) {
  event.key = key_;
  event.at = now.wall;
  event.detail = fit_reason(std::move(event.detail));
  out_.emplace_back(Tell{std::move(event)});
}

void ChannelSession::say(Level level, std::string text) {
  out_.emplace_back(Say{level, std::move(text)});
}

fabric::ChannelState ChannelSession::state() const {
  using enum fabric::ChannelState;
  if (!link_up_) {
    return link_down;
  }
  if (!active_) {
    // Idle is a word that other gateways rely on.
    return watch_.ignored() ? unserved : idle_seen_ ? idle : link_down;
  }
  if (active_->call.answer) {
    return answering;
  }
  if (active_->held) {
    return held;
  }
  return active_->assignment ? running : waiting;
}

std::string ChannelSession::reason() const {
  if (!link_up_) {
    return link_reason_;
  }
  if (!trouble_.empty()) {
    return trouble_;
  }
  if (active_) {
    return active_->reason;
  }
  if (watch_.ignored()) {
    return left_reason_;
  }
  return idle_seen_ ? std::string() : "connected; what stands in the channel is not known yet";
}

void ChannelSession::show(Moment now) {
  if (!active_ && last_word_) {
    return;
  }
  fabric::ChannelStatus next = status_;
  next.state = state();
  next.reason = fit_reason(reason());
  next.call = active_ ? active_->call.id : fabric::CallId{};
  next.uuid = watch_.ignored() ? watch_.ignored()->uuid : std::string();
  next.attempt = 0;
  next.instance = {};
  if (active_) {
    next.uuid = active_->call.request.uuid;
    if (!active_->call.attempts.empty()) {
      next.attempt = active_->call.attempts.back().number;
    }
    if (active_->assignment) {
      next.instance = active_->assignment->attempt.instance;
    }
  }
  if (shown_ && same(next, *shown_)) {
    return;
  }
  if (!shown_ || next.state != shown_->state || next.call != shown_->call) {
    next.since = now.wall;
  }
  status_ = next;
  shown_ = next;
  out_.emplace_back(Show{std::move(next)});
}

}  // namespace millrace::gateway
