// What people and tools see of a channel: status, events, log.
#include <tuple>
#include <utility>

#include "gateway/channel/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

bool same_counters(const fabric::ChannelStatus& a, const fabric::ChannelStatus& b) {
  const auto all = [](const fabric::ChannelStatus& s) {
    return std::tie(s.calls, s.answered, s.withdrawn, s.repeated, s.late, s.failed);
  };
  return all(a) == all(b);
}

/// `shown` is `reason`, as far as that fits.
bool same_reason(const std::string& shown, std::string_view reason) {
  return shown == reason || shown == fit_reason(std::string(reason));
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
  put(Tell{std::move(event)});
}

void ChannelSession::say(Level level, std::string text) {
  put(Say{level, std::move(text)});
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

std::string_view ChannelSession::reason() const {
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
  return idle_seen_ ? "" : "connected; what stands in the channel is not known yet";
}

void ChannelSession::show(Moment now) {
  if (!active_ && last_word_) {
    return;
  }
  // After each event, and most change nothing: compared before anything is copied.
  const fabric::ChannelState now_state = state();
  const std::string_view now_reason = reason();
  const Call* const call = this->call();
  const std::string_view uuid = call != nullptr    ? std::string_view(call->request.uuid)
                                : watch_.ignored() ? std::string_view(watch_.ignored()->uuid)
                                                   : std::string_view();
  const fabric::CallId id = call != nullptr ? call->id : fabric::CallId{};
  const bool tried = call != nullptr && !call->attempts.empty();
  const std::uint32_t attempt = tried ? call->attempts.back().number : 0;
  const fabric::InstanceId instance =
      active_ && active_->assignment ? active_->assignment->attempt.instance : fabric::InstanceId{};
  if (shown_ && shown_->state == now_state && shown_->call == id && shown_->attempt == attempt &&
      shown_->instance == instance && same_counters(*shown_, status_) && shown_->uuid == uuid &&
      same_reason(shown_->reason, now_reason)) {
    return;
  }
  if (!shown_ || now_state != shown_->state || id != shown_->call) {
    status_.since = now.wall;
  }
  status_.state = now_state;
  status_.reason = fit_reason(std::string(now_reason));
  status_.call = id;
  status_.uuid = uuid;
  status_.attempt = attempt;
  status_.instance = instance;
  shown_ = status_;
  put(Show{status_});
}

}  // namespace millrace::gateway::channel
