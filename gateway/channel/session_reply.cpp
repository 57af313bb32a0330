// What instances say to the call of a channel.
#include <utility>

#include <fmt/format.h>

#include "gateway/channel/session.hpp"
#include "gateway/words.hpp"

namespace millrace::gateway::channel {

Actions ChannelSession::on_reply(const fabric::Reply& reply, Moment now) {
  if (!active_ || reply.call != active_->call.id) {
    late(reply, now);
  } else if (!active_->call.asked(reply.instance)) {
    say(Level::warn,
        fmt::format("call {}: instance {} answers a call that was not given to it; its "
                    "reply is dropped",
                    reply.call.to_string(), reply.instance.to_string()));
  } else if (active_->call.answer) {
    if (active_->call.answer->instance != reply.instance) {
      late(reply, now);
    }
  } else if (reply.text.size() > fabric::max_text) {
    refuse(reply,
           fmt::format("a response of {} bytes; a CNC string holds {}", reply.text.size(),
                       fabric::max_text),
           now);
  } else if (reply.kind == fabric::ReplyKind::interim) {
    take_interim(reply);
  } else {
    take_final(reply, now);
  }
  return finish(now);
}

void ChannelSession::take_interim(const fabric::Reply& reply) {
  Active& active = *active_;
  const bool current = active.assignment && active.assignment->attempt.instance == reply.instance;
  if (!current) {
    return;
  }
  if (reply.state == 0) {
    say(Level::warn,
        fmt::format("call {}: an interim state of 0 says nothing to the program; it is "
                    "not written",
                    reply.call.to_string()));
    return;
  }
  active.interim = reply;
}

void ChannelSession::take_final(const fabric::Reply& reply, Moment now) {
  if (reply.code == fabric::ServiceCode::refused || reply.state == 0) {
    refuse(reply,
           reply.state == 0 && reply.text.empty() ? "state 0, which releases no program"
                                                  : printable(reply.text),
           now);
    return;
  }
  if (reply.code == fabric::ServiceCode::failed) {
    ++status_.failed;
    say(Level::warn, fmt::format("call {}: the service failed: {}", reply.call.to_string(),
                                 printable(reply.text)));
  }
  take_answer({reply.instance, reply.attempt, reply.text, reply.state}, {}, now);
}

void ChannelSession::take_answer(Answer answer, fabric::Event event, Moment now) {
  Active& active = *active_;
  event.kind = fabric::EventKind::replied;
  event.call = active.call.id;
  event.attempt = answer.attempt;
  event.instance = answer.instance;
  event.uuid = active.call.request.uuid;
  event.text = answer.text;
  event.state = answer.state;
  tell(std::move(event), now);
  active.answer_ticket = record(AnsweredEntry{active.call.id, answer});
  active.call.answer = std::move(answer);
  active.interim.reset();
  active.recorded_interim.reset();
  active.reason.clear();
  // The answer's own look comes next; poll only if the journal keeps it waiting.
  due_ = now.steady + pace_.idle;
  put(Freed{active.call.id});
}

void ChannelSession::refuse(const fabric::Reply& reply, const std::string& why, Moment now) {
  ++status_.failed;
  active_->held = true;
  active_->assignment.reset();
  active_->reason =
      fmt::format("the service's answer cannot be written ({}); the program waits", why);
  tell(fabric::EventKind::refused, active_->reason, now);
  say(Level::error, fmt::format("call {}: {}", reply.call.to_string(), active_->reason));
  put(Freed{reply.call});
  if (policy_.refused && policy_.refused->response_state != 0) {
    give_up(*policy_.refused, fmt::format("the service's answer cannot be written: {}", why), now);
  }
}

void ChannelSession::late(const fabric::Reply& reply, Moment now) {
  const bool in_hand = active_ && reply.call == active_->call.id;
  if (!in_hand && (!past_ || past_->call != reply.call ||
                   (past_->answered && past_->answered_by == reply.instance))) {
    // The history of a service that answered long ago, or the same reply delivered twice.
    return;
  }
  ++status_.late;
  fabric::Event event;
  event.kind = fabric::EventKind::late;
  event.call = reply.call;
  event.attempt = reply.attempt;
  event.instance = reply.instance;
  event.text = reply.text;
  event.state = reply.state;
  event.detail = in_hand || past_->answered ? "the call is answered already"
                                            : "the program waits for this answer no more";
  say(Level::info, fmt::format("call {}: the reply of instance {} comes too late: {}",
                               reply.call.to_string(), reply.instance.to_string(), event.detail));
  tell(std::move(event), now);
}

}  // namespace millrace::gateway::channel
