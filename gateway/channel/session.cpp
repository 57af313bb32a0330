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

ChannelSession::ChannelSession(fabric::ChannelKey key, ChannelContext& context, Pace pace,
                               std::shared_ptr<WriteEffects> effects)
    : pace_(pace), out_(std::move(key), context), effects_(std::move(effects)) {}

void ChannelSession::on_link_up(Moment now) {
  assert(io_ == Io::none && "each read and write is answered before the link comes back");
  link_up_ = true;
  idle_seen_ = false;
  trouble_.clear();
  watch_.restart();
  expect_anything(now);
  if (call_) {
    call_->on_link_up(now);
    if (AnswerWriter* const writer = call_->writer()) {
      writer->on_link_up();
    }
  } else if (released_call_) {
    released_call_->answer.read_now();
  }
  due_ = now.steady;
  whole_due_ = now.steady;
  not_before_ = now.steady;
  finish(now);
}

void ChannelSession::on_link_down(const std::string& reason, Moment now) {
  lose_link();
  link_reason_ = reason;
  finish(now);
}

void ChannelSession::on_link_dropped(const std::string& reason, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  watch_.restart();
  AnswerWriter* const writer = io == Io::answer && call_ ? call_->writer() : nullptr;
  if (writer != nullptr && writer->next() != AnswerWriter::Step::read) {
    writer->on_unknown(now.steady);
  }
  if (io == Io::release && released_call_) {
    release_written(WriteOutcome::unknown, now);
  }
  on_link_down(reason, now);
}

void ChannelSession::on_wake(Moment now) {
  finish(now);
}

void ChannelSession::set_told(bool told, Moment now) {
  if (told_ != told) {
    told_ = told;
    if (!told) {
      due_ = std::min(due_, call_ ? next_look_at_call(now) : next_look(now));
    }
  }
  finish(now);
}

void ChannelSession::on_change(Variable variable, Moment now) {
  // RESPONSE_STATE is of interest where REQUEST_STATE may not show that a program has stopped
  // waiting: after an interim answer, and after the final one.
  if (variable == Variable::response_state && !released_call_ && !unseen_release_ &&
      (!call_ || call_->call().shown.empty())) {
    return;
  }
  if (!call_) {
    watch_.expect();
  } else if (AnswerWriter* const writer = call_->writer()) {
    writer->read_now();
  }
  due_ = now.steady;
  look_again_ = io_ == Io::poll;
  finish(now);
}

void ChannelSession::on_read(const Snapshot& snapshot, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  read_time_.came = now.steady;
  trouble_.clear();
  idle_seen_ = idle_seen_ || (snapshot.has(Variable::request_state) && snapshot.request_state == 0);
  if (io == Io::answer && call_ && call_->writer() != nullptr) {
    answer_looked(snapshot, now);
  } else {
    poll(snapshot, now);
  }
  if (std::exchange(look_again_, false)) {
    due_ = now.steady;
  }
  finish(now);
}

void ChannelSession::on_read_failed(const std::string& reason, Moment now) {
  if (std::exchange(io_, Io::none) == Io::answer && call_ && call_->writer() != nullptr) {
    call_->writer()->read_again();
  }
  watch_.restart();
  hold_off(reason, now);
  finish(now);
}

void ChannelSession::on_write(WriteOutcome outcome, const std::string& reason, Moment now) {
  if (std::exchange(io_, Io::none) == Io::release) {
    release_written(outcome, now);
    if (outcome == WriteOutcome::refused) {
      hold_off(reason, now);
    }
    finish(now);
    return;
  }
  AnswerWriter* const writer = call_ ? call_->writer() : nullptr;
  if (writer == nullptr) {
    finish(now);
    return;
  }
  switch (outcome) {
    case WriteOutcome::written:
      writer->on_written(now.steady);
      writer_finished(now);
      break;
    case WriteOutcome::refused:
      writer->read_again();
      hold_off(reason, now);
      break;
    case WriteOutcome::unknown:
      out_.say(
          Level::warn,
          fmt::format("call {}: a write may or may not have taken place ({}); the channel is read "
                      "before anything else is written",
                      call_->id().to_string(), reason));
      writer->on_unknown(now.steady);
      break;
  }
  finish(now);
}

void ChannelSession::leave(const std::string& reason, const Policy& policy, Moment now) {
  assert(found_);
  const PendingRequest request = *std::exchange(found_, std::nullopt);
  const bool news = watch_.ignored() != request;
  if (news) {
    left_.at = now.steady;
    left_.out_of_patience = false;
  }
  if (news || left_.reason != reason) {
    fabric::Event event;
    event.kind = fabric::EventKind::unserved;
    event.uuid = request.uuid;
    event.text = request.text;
    event.state = request.state;
    event.detail = reason;
    out_.tell(std::move(event), now);
    out_.say(Level::warn, reason);
  }
  left_.policy = policy;
  left_.reason = reason;
  watch_.ignore(request);
  finish(now);
}

void ChannelSession::reconsider(Moment now) {
  if (watch_.ignored()) {
    watch_.reconsider();
    left_.out_of_patience = false;
    due_ = now.steady;
  }
  finish(now);
}

void ChannelSession::retire(Moment now) {
  retired_ = true;
  finish(now);
}

void ChannelSession::hand_over(const std::string& reason, Moment now) {
  retired_ = true;
  handed_over_ = reason;
  // An answer that has begun to release the program is brought to its end; nobody else can. After
  // an interim answer the kernel may have cleared REQUEST_STATE, and the other gateway sees no
  // request: the next look tells.
  if (call_ && !call_->call().clearing && call_->call().shown.empty()) {
    leave_to_the_other(now);
  }
  finish(now);
}

void ChannelSession::let_go(Moment now) {
  if (call_ && !may_be_given()) {
    out_.show_idle("the gateway is ending", now);
  }
}

void ChannelSession::keep(Moment now) {
  retired_ = false;
  handed_over_.clear();
  last_word_ = false;
  idle_seen_ = false;
  if (!has_work()) {
    released_call_.reset();
  }
  if (!call_ && !(released_call_ && released_call_->open)) {
    expect_anything(now);
  }
  due_ = now.steady;
  finish(now);
}

void ChannelSession::finish(Moment now) {
  if (!found_) {
    check_patience(now);
    advance(now);
  }
  show(now);
}

void ChannelSession::check_patience(Moment now) {
  if (call_) {
    ask_call(now, [&](OpenCall& call) { call.check_patience(out_, now); });
    return;
  }
  const auto& rule = left_.policy.unserved;
  if (!retired_ && watch_.ignored() && !left_.out_of_patience && rule &&
      now.steady - left_.at >= rule->after) {
    // Read once more and offered with the note that its time is up.
    left_.out_of_patience = true;
    watch_.reconsider();
    due_ = now.steady;
  }
}

void ChannelSession::advance(Moment now) {
  if (!link_up_ || io_ != Io::none || (retired_ && !has_work())) {
    return;
  }
  if (now.steady < not_before_) {
    out_.news().wake_at = not_before_;
    return;
  }
  if (drive_writer(now)) {
    return;
  }
  const bool confirming = !call_ && !released_call_ && watch_.confirming();
  const SteadyTime due = confirming ? std::max(due_, confirm_at_) : due_;
  if (now.steady >= due) {
    read(poll_look(now), Io::poll, now);
  } else {
    out_.news().wake_at = due;
  }
}

void ChannelSession::poll(const Snapshot& snapshot, Moment now) {
  if (call_) {
    poll_call(snapshot, now);
    return;
  }
  if (released_call_ && !release_is_over(snapshot, now)) {
    return;
  }
  if (retired_) {
    return;
  }
  if (!may_be_request(snapshot, now)) {
    due_ = now.steady + pace_.active;
    return;
  }
  const bool whole = now.steady >= whole_due_;
  if (whole) {
    whole_due_ = now.steady + pace_.whole;
  }
  found_ = watch_.on_look(snapshot, whole);
  if (found_) {
    out_.news().found = true;
  }
  due_ = watch_.reading() ? now.steady : next_look(now);
  // A controller that shows our writes late may show the variables of a request one after another.
  confirm_at_ = now.steady + effects_->lag;
}

void ChannelSession::expect_anything(Moment now) {
  unknown_until_ = now.steady + takes_effect;
  unknown_.reset();
}

/// A state beside a request may be that of an interim answer, or of a final one of a gateway that
/// is gone, whose REQUEST_STATE = 0 this controller does not show yet.
bool ChannelSession::may_be_request(const Snapshot& snapshot, Moment now) {
  if (!unknown_until_) {
    return true;
  }
  const bool moves = unknown_ && (unknown_->request_state != snapshot.request_state ||
                                  unknown_->response_state != snapshot.response_state);
  if (snapshot.request_state != 0 && snapshot.response_state != 0 && !moves &&
      now.steady < *unknown_until_) {
    unknown_ = snapshot;
    return false;
  }
  if (unseen_release_ && now.steady < unseen_release_->until && snapshot.response_state == 0 &&
      !moves) {
    return true;
  }
  unseen_release_.reset();
  unknown_until_.reset();
  unknown_.reset();
  return true;
}

bool ChannelSession::released_late(const Snapshot& snapshot, Moment now) const {
  return unseen_release_ && now.steady < unseen_release_->until && snapshot.request_state != 0 &&
         snapshot.response_state == unseen_release_->state &&
         call_->call().awaited == fabric::Awaited::response_state &&
         std::ranges::count(call_->call().shown, snapshot.response_state) == 0;
}

SteadyTime ChannelSession::next_look(Moment now) const {
  const bool soon = now.steady < active_until_;
  return next_beat(now.steady, told_ ? pace_.safety : soon ? pace_.active : pace_.idle);
}

SteadyTime ChannelSession::next_look_at_call(Moment now) const {
  return told_ ? next_beat(now.steady, pace_.safety) : now.steady + pace_.idle;
}

void ChannelSession::poll_call(const Snapshot& snapshot, Moment now) {
  const Standing standing = call_->on_snapshot(snapshot, now);
  if (call_->may_show_interim(snapshot, standing)) {
    due_ = now.steady + pace_.active;
    return;
  }
  if (standing != Standing::pending) {
    end(false, why_over(standing, snapshot), now);
    return;
  }
  if (other_can_see(snapshot, now)) {
    leave_to_the_other(now);
    return;
  }
  due_ = next_look_at_call(now);
  if (snapshot.look == ReadSet::request) {
    whole_due_ = now.steady + pace_.whole;
    if (!call_->verify(out_, now)) {
      end(false, "the gateway was restarted before it had answered; the request is read again",
          now);
    }
  }
}

ReadSet ChannelSession::poll_look(Moment now) const {
  if (!call_) {
    return released_call_                        ? released_call_->answer.reads()
           : unknown_until_ && !watch_.reading() ? ReadSet::states
                                                 : watch_.look();
  }
  if (!call_->verified() || now.steady >= whole_due_) {
    return ReadSet::request;
  }
  return call_->call().shown.empty() ? ReadSet::state : ReadSet::states;
}

void ChannelSession::read(ReadSet look, Io io, Moment now) {
  io_ = io;
  read_time_.asked = now.steady;
  out_.read(look);
}

void ChannelSession::write(Variable variable, Value value, bool releases) {
  io_ = Io::answer;
  out_.write({variable, std::move(value), releases});
}

void ChannelSession::hold_off(const std::string& reason, Moment now) {
  not_before_ = now.steady + pace_.retry;
  if (!reason.empty() && trouble_ != reason && link_up_) {
    trouble_ = reason;
    out_.say(Level::warn, reason);
  }
}

void ChannelSession::show(Moment now) {
  // A channel that is given up takes its problem with it.
  const bool watched = link_up_ && (!retired_ || has_work());
  const std::string_view problem = watched ? write_problem() : std::string_view();
  if (write_problem_ != problem) {
    write_problem_ = problem;
    out_.tell_write_problem(write_problem_);
  }
  if (!call_ && last_word_) {
    return;
  }
  using enum fabric::ChannelState;
  ChannelView view;
  if (call_) {
    view = call_->view();
  } else if (released_call_ && released_call_->open) {
    // The journal still has the call, and so has who takes the channel over.
    view.state = answering;
    view.uuid = released_call_->answer.request().uuid;
    view.call = released_call_->call;
    view.reason = "answered; no read has shown yet that the program has gone on";
  } else if (watch_.ignored()) {
    view.state = unserved;
    view.uuid = watch_.ignored()->uuid;
    view.reason = left_.reason;
  } else if (idle_seen_) {
    view.state = idle;
  } else {
    // Idle is a word that other gateways rely on.
    view.reason = unknown_ ? "RESPONSE_STATE stands beside a request: it may be answered already"
                           : "connected; what stands in the channel is not known yet";
  }
  if (!link_up_) {
    view.state = link_down;
    view.reason = link_reason_;
  } else if (!trouble_.empty()) {
    view.reason = trouble_;
  } else if (!problem.empty()) {
    view.reason = problem;
  } else if (call_ && call_->waits_for_journal() && !out_.journal_trouble().empty()) {
    view.reason = out_.journal_trouble();
  }
  out_.show(view, now);
}

}  // namespace millrace::gateway::channel
