#include "gateway/channel/channel.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::channel {

namespace {

/// The next multiple of the period: channels that are read equally often are read together, so that
/// their requests share a segment on the wire and a turn of the gateway's loop.
SteadyTime next_multiple(SteadyTime now, std::chrono::milliseconds period) {
  return SteadyTime((now.time_since_epoch() / period + 1) * period);
}

}  // namespace

Channel::Channel(fabric::ChannelKey key, ChannelContext& context, ReadIntervals intervals,
                 std::shared_ptr<WriteEffects> effects)
    : intervals_(intervals), out_(std::move(key), context), effects_(std::move(effects)) {}

void Channel::on_link_up(Moment now) {
  assert(io_ == Io::none && "all reads and writes end before the connection is restored");
  link_up_ = true;
  zero_seen_ = false;
  controller_error_.clear();
  reader_.restart();
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

void Channel::on_link_down(const fabric::Message& reason, Moment now) {
  lose_link();
  link_reason_ = reason;
  finish(now);
}

void Channel::on_link_dropped(const fabric::Message& reason, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  reader_.restart();
  AnswerWriter* const writer = io == Io::answer && call_ ? call_->writer() : nullptr;
  if (writer != nullptr && writer->next() != AnswerWriter::Step::read) {
    writer->on_unknown(now.steady);
  }
  if (io == Io::release && released_call_) {
    release_written(WriteOutcome::unknown, now);
  }
  on_link_down(reason, now);
}

void Channel::on_wake(Moment now) {
  finish(now);
}

void Channel::set_notified(bool notified, Moment now) {
  if (notified_ != notified) {
    notified_ = notified;
    if (!notified) {
      due_ = std::min(due_, call_ ? next_read_of_call(now) : next_read(now));
    }
  }
  finish(now);
}

void Channel::on_change(Variable variable, Moment now) {
  // RESPONSE_STATE is of interest where REQUEST_STATE may not show that a program has stopped
  // waiting: after an interim answer, and after the final one.
  if (variable == Variable::response_state && !released_call_ && !unseen_release_ &&
      (!call_ || call_->call().shown.empty())) {
    return;
  }
  if (!call_) {
    reader_.read_whole();
  } else if (AnswerWriter* const writer = call_->writer()) {
    writer->read_now();
  }
  due_ = now.steady;
  read_again_ = io_ == Io::poll;
  finish(now);
}

void Channel::on_read(const ServiceSnapshot& snapshot, Moment now) {
  const Io io = std::exchange(io_, Io::none);
  read_time_.came = now.steady;
  controller_error_.clear();
  zero_seen_ = zero_seen_ || (snapshot.has(Variable::request_state) && snapshot.request_state == 0);
  if (io == Io::answer && call_ && call_->writer() != nullptr) {
    answer_read(snapshot, now);
  } else {
    poll(snapshot, now);
  }
  if (std::exchange(read_again_, false)) {
    due_ = now.steady;
  }
  finish(now);
}

void Channel::on_read_failed(const fabric::Message& reason, Moment now) {
  if (std::exchange(io_, Io::none) == Io::answer && call_ && call_->writer() != nullptr) {
    call_->writer()->read_again();
  }
  reader_.restart();
  hold_off(reason, now);
  finish(now);
}

void Channel::on_write(WriteOutcome outcome, const fabric::Message& reason, Moment now) {
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
      out_.log(Level::warn,
               fmt::format("call {}: a write may or may not have reached the controller ({}); the "
                           "channel is read before the next write",
                           call_->id().to_string(), reason));
      writer->on_unknown(now.steady);
      break;
  }
  finish(now);
}

void Channel::leave_unserved(const fabric::Message& reason, const Policy& policy, Moment now) {
  assert(found_);
  const PendingRequest request = *std::exchange(found_, std::nullopt);
  const bool news = reader_.unserved() != request;
  if (news) {
    unserved_.at = now.steady;
    unserved_.deadline_passed = false;
  }
  if (news || unserved_.reason != reason) {
    fabric::Event event;
    event.kind = fabric::EventKind::unserved;
    event.uuid = request.uuid;
    event.text = request.text;
    event.state = request.state;
    event.detail = reason;
    out_.publish(std::move(event), now);
    out_.log(Level::warn, reason);
  }
  unserved_.policy = policy;
  unserved_.reason = reason;
  reader_.leave_unserved(request);
  finish(now);
}

void Channel::offer_again(Moment now) {
  if (reader_.unserved()) {
    reader_.offer_again();
    unserved_.deadline_passed = false;
    due_ = now.steady;
  }
  finish(now);
}

void Channel::drain(Moment now) {
  draining_ = true;
  finish(now);
}

void Channel::hand_over(const fabric::Message& reason, Moment now) {
  draining_ = true;
  handed_over_ = reason;
  // A response that has begun to release the NC program is completed: no other gateway can do that.
  // After an interim response the kernel may have cleared REQUEST_STATE, and the other gateway sees
  // no request: the next read decides.
  if (call_ && !call_->call().clearing && call_->call().shown.empty()) {
    leave_to_the_other(now);
  }
  finish(now);
}

void Channel::shut_down(Moment now) {
  if (call_ && !may_be_assigned()) {
    out_.publish_idle(base::messages::gateway_ending(), now);
  }
}

void Channel::resume_ownership(Moment now) {
  draining_ = false;
  handed_over_.clear();
  final_status_ = false;
  zero_seen_ = false;
  if (!has_work()) {
    released_call_.reset();
  }
  if (!call_ && !(released_call_ && released_call_->open)) {
    expect_anything(now);
  }
  due_ = now.steady;
  finish(now);
}

void Channel::finish(Moment now) {
  if (!found_) {
    check_deadlines(now);
    advance(now);
  }
  publish_status(now);
}

void Channel::check_deadlines(Moment now) {
  if (call_) {
    ask_call(now, [&](OpenCall& call) { call.check_deadlines(out_, now); });
    return;
  }
  const auto& rule = unserved_.policy.unserved;
  if (!draining_ && reader_.unserved() && !unserved_.deadline_passed && rule &&
      now.steady - unserved_.at >= rule->after) {
    // Read once more and offered with the note that its time is up.
    unserved_.deadline_passed = true;
    reader_.offer_again();
    due_ = now.steady;
  }
}

void Channel::advance(Moment now) {
  if (!link_up_ || io_ != Io::none || (draining_ && !has_work())) {
    return;
  }
  if (now.steady < not_before_) {
    out_.news().wake_at = not_before_;
    return;
  }
  if (drive_writer(now)) {
    return;
  }
  const bool confirming = !call_ && !released_call_ && reader_.confirming();
  const SteadyTime due = confirming ? std::max(due_, confirm_at_) : due_;
  if (now.steady >= due) {
    read(poll_set(now), Io::poll, now);
  } else {
    out_.news().wake_at = due;
  }
}

void Channel::poll(const ServiceSnapshot& snapshot, Moment now) {
  if (call_) {
    poll_call(snapshot, now);
    return;
  }
  if (released_call_ && !release_is_over(snapshot, now)) {
    return;
  }
  if (draining_) {
    return;
  }
  if (!may_be_request(snapshot, now)) {
    due_ = now.steady + intervals_.after_answer;
    return;
  }
  const bool whole = now.steady >= whole_due_;
  if (whole) {
    whole_due_ = now.steady + intervals_.full;
  }
  found_ = reader_.on_read(snapshot, whole);
  if (found_) {
    out_.news().found = true;
  }
  due_ = reader_.reading() ? now.steady : next_read(now);
  // A controller that shows our writes late may show the variables of a request one after another.
  confirm_at_ = now.steady + effects_->lag;
}

void Channel::expect_anything(Moment now) {
  unknown_until_ = now.steady + takes_effect;
  unknown_.reset();
}

/// A state beside a request may be that of an interim answer, or of a final one of a gateway that
/// is gone, whose REQUEST_STATE = 0 this controller does not show yet.
bool Channel::may_be_request(const ServiceSnapshot& snapshot, Moment now) {
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

bool Channel::released_late(const ServiceSnapshot& snapshot, Moment now) const {
  return unseen_release_ && now.steady < unseen_release_->until && snapshot.request_state != 0 &&
         snapshot.response_state == unseen_release_->state &&
         call_->call().completion_signal == fabric::CompletionSignal::response_state &&
         std::ranges::count(call_->call().shown, snapshot.response_state) == 0;
}

SteadyTime Channel::next_read(Moment now) const {
  const bool soon = now.steady < active_until_;
  return next_multiple(now.steady, notified_ ? intervals_.subscribed
                                   : soon    ? intervals_.after_answer
                                             : intervals_.idle);
}

SteadyTime Channel::next_read_of_call(Moment now) const {
  return notified_ ? next_multiple(now.steady, intervals_.subscribed)
                   : now.steady + intervals_.idle;
}

void Channel::poll_call(const ServiceSnapshot& snapshot, Moment now) {
  const RequestStatus status = call_->on_snapshot(snapshot, now);
  if (call_->may_show_interim(snapshot, status)) {
    due_ = now.steady + intervals_.after_answer;
    return;
  }
  if (status != RequestStatus::pending) {
    end(false, end_reason(status, snapshot), now);
    return;
  }
  if (other_can_see(snapshot, now)) {
    leave_to_the_other(now);
    return;
  }
  due_ = next_read_of_call(now);
  if (snapshot.set == ReadSet::request) {
    whole_due_ = now.steady + intervals_.full;
    if (!call_->verify(out_, now)) {
      end(false, base::messages::read_again(), now);
    }
  }
}

ReadSet Channel::poll_set(Moment now) const {
  if (!call_) {
    return released_call_                         ? released_call_->answer.reads()
           : unknown_until_ && !reader_.reading() ? ReadSet::states
                                                  : reader_.reads();
  }
  if (!call_->verified() || now.steady >= whole_due_) {
    return ReadSet::request;
  }
  return call_->call().shown.empty() ? ReadSet::state : ReadSet::states;
}

void Channel::read(ReadSet set, Io io, Moment now) {
  io_ = io;
  read_time_.asked = now.steady;
  out_.read(set);
}

void Channel::write(Variable variable, Value value, bool releases) {
  io_ = Io::answer;
  out_.write({variable, std::move(value), releases});
}

void Channel::hold_off(const fabric::Message& reason, Moment now) {
  not_before_ = now.steady + intervals_.retry;
  if (!reason.empty() && controller_error_ != reason && link_up_) {
    controller_error_ = reason;
    out_.log(Level::warn, reason);
  }
}

void Channel::publish_status(Moment now) {
  // A channel that is given up takes its problem with it.
  const bool watched = link_up_ && (!draining_ || has_work());
  const fabric::Message& problem = watched ? write_problem() : no_reason;
  if (write_problem_ != problem) {
    write_problem_ = problem;
    out_.report_write_problem(write_problem_);
  }
  if (!call_ && final_status_) {
    return;
  }
  using enum fabric::ChannelState;
  ChannelView view;
  if (call_) {
    view = call_->view();
  } else if (released_call_ && released_call_->open) {
    // The journal still has the call, and so does the gateway that takes over the channel.
    view.state = answering;
    view.uuid = released_call_->answer.request().uuid;
    view.call = released_call_->call;
    static const fabric::Message release_not_seen = base::messages::release_not_seen();
    view.reason = &release_not_seen;
  } else if (reader_.unserved()) {
    view.state = unserved;
    view.uuid = reader_.unserved()->uuid;
    view.reason = &unserved_.reason;
  } else if (zero_seen_) {
    view.state = idle;
  } else {
    // Idle is a word that other gateways rely on.
    static const fabric::Message beside_request = base::messages::response_state_beside_request();
    static const fabric::Message not_read_yet = base::messages::not_read_yet();
    view.reason = unknown_ ? &beside_request : &not_read_yet;
  }
  if (!link_up_) {
    view.state = link_down;
    view.reason = &link_reason_;
  } else if (!controller_error_.empty()) {
    view.reason = &controller_error_;
  } else if (!problem.empty()) {
    view.reason = &problem;
  } else if (call_ && call_->waits_for_journal() && !out_.journal_error().empty()) {
    view.reason = &out_.journal_error();
  }
  out_.publish_status(view, now);
}

}  // namespace millrace::gateway::channel
