#include "gateway/channel/session.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "gateway/words.hpp"

namespace millrace::gateway::channel {

namespace {

/// The next multiple of the period: channels that are looked at equally often are looked at
/// together, so that their requests share a segment on the wire and a turn of the gateway's loop.
SteadyTime next_beat(SteadyTime now, std::chrono::milliseconds period) {
  return SteadyTime((now.time_since_epoch() / period + 1) * period);
}

}  // namespace

ChannelSession::ChannelSession(fabric::ChannelKey key, Pace pace)
    : key_(std::move(key)), pace_(pace) {
  status_.key = key_;
}

void ChannelSession::resume(Call call, const Policy& policy) {
  assert(!link_up_ && !active_);
  active_ = Active{};
  active_->call = std::move(call);
  policy_ = policy;
  active_->reason = "resumed from the journal";
  if (const auto& answer = active_->call.answer) {
    // Its own looks find out whether the program still waits.
    active_->writer = AnswerWriter::resumed(answer->text, answer->state, active_->call.clearing);
  } else {
    active_->verified = false;
  }
}

Actions ChannelSession::on_link_up(Moment now) {
  assert(io_ == Io::none && "each read and write is answered before the link comes back");
  link_up_ = true;
  idle_seen_ = false;
  trouble_.clear();
  watch_.restart();
  if (active_ && active_->writer) {
    active_->writer->look_again();
  }
  if (active_ && active_->since == SteadyTime{}) {
    // The wall clock may have been set since; a call is never older than the gateway's clock.
    const std::chrono::nanoseconds age = now.wall - active_->call.seen;
    active_->since = now.steady - std::max(age, std::chrono::nanoseconds(0));
    active_->age_known = age >= std::chrono::nanoseconds(0);
  }
  due_ = now.steady;
  whole_due_ = now.steady;
  not_before_ = now.steady;
  return finish(now);
}

Actions ChannelSession::on_link_down(const std::string& reason, Moment now) {
  link_up_ = false;
  link_reason_ = reason;
  return finish(now);
}

Actions ChannelSession::on_link_dropped(const std::string& reason, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  watch_.restart();
  if (io == Io::answer && active_ && active_->writer) {
    if (active_->writer->next() == AnswerWriter::Step::look) {
      active_->writer->look_again();
    } else {
      active_->writer->on_unknown();
    }
  }
  return on_link_down(reason, now);
}

Actions ChannelSession::on_wake(Moment now) {
  return finish(now);
}

Actions ChannelSession::on_read(const Snapshot& snapshot, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  trouble_.clear();
  idle_seen_ = idle_seen_ || (snapshot.has(Variable::request_state) && snapshot.request_state == 0);
  if (io == Io::answer && active_ && active_->writer) {
    answer_looked(snapshot, now);
  } else {
    poll(snapshot, now);
  }
  return finish(now);
}

Actions ChannelSession::on_read_failed(const std::string& reason, Moment now) {
  io_ = Io::none;
  watch_.restart();
  hold_off(reason, now);
  return finish(now);
}

Actions ChannelSession::on_write(WriteOutcome outcome, const std::string& reason, Moment now) {
  io_ = Io::none;
  if (!active_ || !active_->writer) {
    return finish(now);
  }
  AnswerWriter& writer = *active_->writer;
  switch (outcome) {
    case WriteOutcome::written:
      writer.on_written();
      writer_finished(now);
      break;
    case WriteOutcome::refused:
      writer.look_again();
      hold_off(reason, now);
      break;
    case WriteOutcome::unknown:
      say(Level::warn, fmt::format("call {}: a write may or may not have taken place ({}); looking "
                                   "at the channel before anything else is written",
                                   active_->call.id.to_string(), reason));
      writer.on_unknown();
      break;
  }
  return finish(now);
}

Actions ChannelSession::on_recorded(std::uint64_t ticket, Moment now) {
  if (!active_ || ticket == 0) {
    return {};
  }
  Active& active = *active_;
  if (ticket == active.dispatch_ticket) {
    active.dispatch_ticket = 0;
    publish(now);
  } else if (ticket == active.interim_ticket) {
    active.interim_ticket = 0;
  } else if (ticket == active.answer_ticket) {
    active.answer_ticket = 0;
  } else if (ticket == active.clearing_ticket) {
    active.clearing_ticket = 0;
    active.call.clearing = true;
    if (active.writer->next() == AnswerWriter::Step::record_clearing) {
      active.writer->on_recorded(now.steady - looked_at_ <= pace_.fresh);
    }
  }
  return finish(now);
}

Actions ChannelSession::claim(fabric::CallId id, const Policy& policy, Moment now) {
  assert(offered_ && !active_);
  policy_ = policy;
  out_of_patience_ = false;
  active_ = Active{};
  active_->since = now.steady;
  active_->age_known = true;
  active_->call.id = id;
  active_->call.key = key_;
  active_->call.request = *std::exchange(offered_, std::nullopt);
  active_->call.seen = now.wall;
  ++status_.calls;
  whole_due_ = now.steady + pace_.whole;
  tell(fabric::EventKind::seen, "", now);
  say(Level::debug,
      fmt::format("call {} seen: {} \"{}\", state {}", id.to_string(),
                  printable(active_->call.request.uuid), printable(active_->call.request.text),
                  active_->call.request.state));
  return finish(now);
}

Actions ChannelSession::leave(const std::string& reason, const Policy& policy, Moment now) {
  assert(offered_);
  const PendingRequest request = *std::exchange(offered_, std::nullopt);
  policy_ = policy;
  if (watch_.ignored() != request) {
    left_at_ = now.steady;
    out_of_patience_ = false;
  }
  if (left_reason_ != reason || watch_.ignored() != request) {
    fabric::Event event;
    event.kind = fabric::EventKind::unserved;
    event.uuid = request.uuid;
    event.text = request.text;
    event.state = request.state;
    event.detail = reason;
    tell(std::move(event), now);
    say(Level::warn, reason);
  }
  left_reason_ = reason;
  watch_.ignore(request);
  return finish(now);
}

Actions ChannelSession::reconsider(Moment now) {
  if (watch_.ignored()) {
    watch_.reconsider();
    out_of_patience_ = false;
    due_ = now.steady;
  }
  return finish(now);
}

Actions ChannelSession::retire(Moment now) {
  retired_ = true;
  return finish(now);
}

Actions ChannelSession::release(const std::string& reason, Moment now) {
  retired_ = true;
  released_ = reason;
  // An answer that has begun to release the program is brought to its end; nobody else can. After
  // an interim answer the kernel may have cleared REQUEST_STATE, and the other gateway sees no
  // request: the next look tells.
  if (active_ && !active_->call.clearing && active_->call.shown.empty()) {
    leave_to_the_other(now);
  }
  return finish(now);
}

void ChannelSession::leave_to_the_other(Moment now) {
  last_word_ = may_be_given();
  end(false, released_, now);
}

bool ChannelSession::may_be_given() const {
  // What is held was given out by an earlier gateway, if not by us.
  return active_ && (!active_->call.attempts.empty() || active_->assignment || active_->held ||
                     active_->call.delivery == fabric::Delivery::at_most_once);
}

Actions ChannelSession::let_go(Moment now) {
  if (active_ && !may_be_given()) {
    fabric::ChannelStatus last = status_;
    last.state = fabric::ChannelState::idle;
    last.call = {};
    last.since = now.wall;
    last.reason = "the gateway is ending";
    put(Show{std::move(last)});
  }
  return std::exchange(out_, {});
}

bool ChannelSession::other_can_see(const Snapshot& snapshot) const {
  return !released_.empty() && !active_->call.clearing && snapshot.has(Variable::request_state) &&
         snapshot.request_state != 0;
}

Actions ChannelSession::keep(Moment now) {
  retired_ = false;
  released_.clear();
  last_word_ = false;
  idle_seen_ = false;
  due_ = now.steady;
  return finish(now);
}

Actions ChannelSession::finish(Moment now) {
  if (!offered_) {
    check_patience(now);
    advance(now);
  }
  show(now);
  return std::exchange(out_, {});
}

void ChannelSession::put(Action action) {
  if (out_.capacity() == 0) {
    out_.reserve(few_actions);
  }
  out_.push_back(std::move(action));
}

void ChannelSession::advance(Moment now) {
  if (!link_up_ || io_ != Io::none || (retired_ && !active_)) {
    return;
  }
  if (now.steady < not_before_) {
    wake_at(not_before_);
  } else if (drive_writer(now)) {
    return;
  } else if (now.steady >= due_) {
    read(poll_look(now), Io::poll);
  } else {
    wake_at(due_);
  }
}

void ChannelSession::poll(const Snapshot& snapshot, Moment now) {
  if (active_) {
    poll_call(snapshot, now);
    return;
  }
  if (retired_) {
    return;
  }
  const bool whole = now.steady >= whole_due_;
  if (whole) {
    whole_due_ = now.steady + pace_.whole;
  }
  offered_ = watch_.on_look(snapshot, whole);
  if (offered_) {
    put(Offer{*offered_, out_of_patience_});
  }
  const bool soon = now.steady < active_until_;
  due_ = watch_.reading() ? now.steady : next_beat(now.steady, soon ? pace_.active : pace_.idle);
}

void ChannelSession::poll_call(const Snapshot& snapshot, Moment now) {
  Active& active = *active_;
  const Standing standing = judge(snapshot, active.call.request, active.call.shown);
  if (standing != Standing::pending) {
    end(false, why_over(standing, snapshot), now);
    return;
  }
  if (other_can_see(snapshot)) {
    leave_to_the_other(now);
    return;
  }
  due_ = now.steady + pace_.idle;
  if (snapshot.look == ReadSet::request) {
    whole_due_ = now.steady + pace_.whole;
    if (!active.verified) {
      active.verified = true;
      if (active.call.attempts.back().number == 0 &&
          active.call.delivery == fabric::Delivery::at_least_once) {
        // It was about to be answered in the service's place, and nobody was asked.
        end(false, "the gateway started again before it had answered; looked at anew", now);
        return;
      }
      put(Resume{active.call.id});
    }
  }
}

ReadSet ChannelSession::poll_look(Moment now) const {
  if (!active_) {
    return watch_.look();
  }
  if (!active_->verified || now.steady >= whole_due_) {
    return ReadSet::request;
  }
  return active_->call.shown.empty() ? ReadSet::state : ReadSet::states;
}

void ChannelSession::read(ReadSet look, Io io) {
  io_ = io;
  put(Read{look});
}

void ChannelSession::write(Variable variable, Value value) {
  io_ = Io::answer;
  put(Write{variable, std::move(value)});
}

void ChannelSession::wake_at(SteadyTime at) {
  put(WakeAt{at});
}

std::uint64_t ChannelSession::record(JournalEntry entry) {
  const std::uint64_t ticket = next_ticket_++;
  put(Record{ticket, std::move(entry)});
  return ticket;
}

void ChannelSession::hold_off(const std::string& reason, Moment now) {
  not_before_ = now.steady + pace_.retry;
  if (!reason.empty() && trouble_ != reason && link_up_) {
    trouble_ = reason;
    say(Level::warn, reason);
  }
}

}  // namespace millrace::gateway::channel
