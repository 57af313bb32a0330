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

Channel::Channel(fabric::ChannelKey key, ServiceAccess& access, ChannelContext& context,
                 ControllerReads& controller)
    : out_(std::move(key), access, context), controller_(controller) {}

void Channel::on_link_up(Moment now) {
  assert(io_.purpose == Purpose::none && "all requests end before the connection is restored");
  link_.up = true;
  link_.zero_seen = false;
  link_.error.clear();
  link_.strange_writes_until = now.steady + takes_effect;
  expect_anything(now);
  if (RequestReader* const looking = reader()) {
    looking->restart();
  } else if (OpenCall* const call = open_call()) {
    call->on_link_up(now);
    if (AnswerWriter* const writing = writer()) {
      writing->on_link_up();
    }
  } else if (ReleasedCall* const last = released()) {
    last->answer.read_now();
  }
  reads_.due = reads_.whole_due = reads_.not_before = now.steady;
  finish(now);
}

void Channel::on_link_down(const fabric::Message& reason, Moment now) {
  lose_link();
  link_.down_reason = reason;
  finish(now);
}

void Channel::on_link_dropped(const fabric::Message& reason, Moment now) {
  const Purpose purpose = std::exchange(io_.purpose, Purpose::none);
  if (RequestReader* const looking = reader()) {
    looking->restart();
  }
  AnswerWriter* const writing = purpose == Purpose::answer ? writer() : nullptr;
  if (writing != nullptr && writing->next() != AnswerWriter::Step::read) {
    writing->on_unknown(now.steady);
  }
  if (purpose == Purpose::release && released() != nullptr) {
    release_written(WriteOutcome::unknown, now);
  }
  on_link_down(reason, now);
}

void Channel::on_wake(Moment now) {
  finish(now);
}

void Channel::set_notified(bool notified, Moment now) {
  if (reads_.notified != notified) {
    reads_.notified = notified;
    if (!notified) {
      reads_.due =
          std::min(reads_.due, open_call() != nullptr ? next_read_of_call(now) : next_read(now));
    }
  }
  finish(now);
}

void Channel::on_change(Variable variable, Moment now) {
  // RESPONSE_STATE is of interest where REQUEST_STATE may not show that a program has stopped
  // waiting: after an interim answer, and after the final one.
  if (variable == Variable::response_state && released() == nullptr && !earlier_.release &&
      (call() == nullptr || call()->shown.empty())) {
    return;
  }
  if (RequestReader* const looking = reader()) {
    looking->read_whole();
  } else if (AnswerWriter* const writing = writer()) {
    writing->read_now();
  }
  reads_.due = now.steady;
  io_.read_again = io_.purpose == Purpose::poll;
  finish(now);
}

void Channel::on_read(const ServiceSnapshot& snapshot, Moment now) {
  const Purpose purpose = std::exchange(io_.purpose, Purpose::none);
  io_.read.came = now.steady;
  link_.error.clear();
  link_.zero_seen =
      link_.zero_seen || (snapshot.has(Variable::request_state) && snapshot.request_state == 0);
  if (purpose == Purpose::answer && writer() != nullptr) {
    answer_read(snapshot, now);
  } else {
    poll(snapshot, now);
  }
  if (std::exchange(io_.read_again, false)) {
    reads_.due = now.steady;
  }
  finish(now);
}

void Channel::on_read_failed(const fabric::Message& reason, Moment now) {
  if (std::exchange(io_.purpose, Purpose::none) == Purpose::answer && writer() != nullptr) {
    writer()->read_again();
  }
  if (RequestReader* const looking = reader()) {
    looking->restart();
  }
  hold_off(reason, now);
  finish(now);
}

void Channel::on_write(WriteOutcome outcome, const fabric::Message& reason, Moment now) {
  if (std::exchange(io_.purpose, Purpose::none) == Purpose::release) {
    release_written(outcome, now);
    if (outcome == WriteOutcome::refused) {
      hold_off(reason, now);
    }
    finish(now);
    return;
  }
  AnswerWriter* const writing = writer();
  if (writing == nullptr) {
    finish(now);
    return;
  }
  switch (outcome) {
    case WriteOutcome::written:
      writing->on_written(now.steady);
      writer_finished(now);
      break;
    case WriteOutcome::refused:
      writing->read_again();
      hold_off(reason, now);
      break;
    case WriteOutcome::unknown:
      out_.log(Level::warn,
               fmt::format("call {}: a write may or may not have reached the controller ({}); the "
                           "channel is read before the next write",
                           call()->id.to_string(), reason));
      writing->on_unknown(now.steady);
      break;
  }
  finish(now);
}

bool Channel::deadline_passed() const {
  const auto& [reader, request] = std::get<Found>(phase_);
  return reader.unserved() && reader.unserved()->request == request && reader.unserved()->overdue;
}

void Channel::leave_unserved(const fabric::Message& reason, const Policy& policy, Moment now) {
  Found found = std::move(std::get<Found>(phase_));
  RequestReader& looking = phase_.emplace<RequestReader>(std::move(found.reader));
  if (looking.leave_unserved(std::move(found.request), reason, policy, now.steady)) {
    const PendingRequest& request = looking.unserved()->request;
    fabric::Event event;
    event.kind = fabric::EventKind::unserved;
    event.uuid = request.uuid;
    event.text = request.text;
    event.state = request.state;
    event.detail = reason;
    out_.publish(std::move(event), now);
    out_.log(Level::warn, reason);
  }
  finish(now);
}

void Channel::offer_again(Moment now) {
  if (RequestReader* const looking = reader(); looking != nullptr && looking->offer_again(false)) {
    reads_.due = now.steady;
  }
  finish(now);
}

void Channel::drain(Moment now) {
  leaving_ = leaving_.value_or(Leaving());
  finish(now);
}

void Channel::hand_over(const fabric::Message& reason, Moment now) {
  leaving_ = leaving_.value_or(Leaving());
  leaving_->handed_over = reason;
  // A response that has begun to release the NC program is completed: no other gateway can do that.
  // After an interim response the kernel may have cleared REQUEST_STATE, and the other gateway sees
  // no request: the next read decides.
  if (call() != nullptr && !call()->clearing && call()->shown.empty()) {
    leave_to_the_other(now);
  }
  finish(now);
}

void Channel::shut_down(Moment now) {
  if (open_call() != nullptr && !may_be_assigned()) {
    out_.publish_idle(base::messages::gateway_ending(), now);
  }
}

void Channel::resume_ownership(Moment now) {
  leaving_.reset();
  link_.zero_seen = false;
  link_.strange_writes_until = now.steady + takes_effect;
  if (released() != nullptr && !has_work()) {
    phase_ = RequestReader();
  }
  if (!has_call()) {
    expect_anything(now);
  }
  reads_.due = now.steady;
  finish(now);
}

void Channel::finish(Moment now) {
  if (!std::holds_alternative<Found>(phase_)) {
    check_deadlines(now);
    advance(now);
  }
  publish_status(now);
}

void Channel::check_deadlines(Moment now) {
  if (OpenCall* const open = open_call()) {
    ask(*open, now, [&](OpenCall& call) { call.check_deadlines(out_, now); });
  } else if (RequestReader* const looking = reader();
             looking != nullptr && !leaving_ && looking->deadline_passes(now.steady)) {
    // Read once more and offered with the note that its time is up.
    looking->offer_again(true);
    reads_.due = now.steady;
  }
}

void Channel::advance(Moment now) {
  if (!link_.up || io_.purpose != Purpose::none || (leaving_ && !has_work())) {
    return;
  }
  if (now.steady < reads_.not_before) {
    out_.news().wake_at = reads_.not_before;
    return;
  }
  if (drive_writer(now)) {
    return;
  }
  const bool confirming = reader() != nullptr && reader()->confirming();
  const SteadyTime due = confirming ? std::max(reads_.due, reads_.confirm_at) : reads_.due;
  if (now.steady >= due) {
    read(poll_set(now), Purpose::poll, now);
  } else {
    out_.news().wake_at = due;
  }
}

void Channel::poll(const ServiceSnapshot& snapshot, Moment now) {
  if (open_call() != nullptr) {
    poll_call(snapshot, now);
    return;
  }
  if (released() != nullptr && !release_is_over(snapshot, now)) {
    return;
  }
  if (leaving_) {
    return;
  }
  if (!may_be_request(snapshot, now)) {
    reads_.due = now.steady + intervals().active;
    return;
  }
  const bool whole = now.steady >= reads_.whole_due;
  if (whole) {
    reads_.whole_due = now.steady + intervals().full;
  }
  RequestReader& looking = std::get<RequestReader>(phase_);
  auto request = looking.on_read(snapshot, whole);
  reads_.due = looking.reading() ? now.steady : next_read(now);
  // A controller that shows our writes late may show the variables of a request one after another.
  reads_.confirm_at = now.steady + controller_.effects.lag;
  if (request) {
    phase_ = Found{std::move(looking), *std::move(request)};
    out_.news().found = true;
  }
}

void Channel::expect_anything(Moment now) {
  earlier_.until = now.steady + takes_effect;
  earlier_.first.reset();
}

/// A state beside a request may be that of an interim answer, or of a final one of a gateway that
/// is gone, whose REQUEST_STATE = 0 this controller does not show yet.
bool Channel::may_be_request(const ServiceSnapshot& snapshot, Moment now) {
  if (!earlier_.until) {
    return true;
  }
  const bool moves = earlier_.first && (earlier_.first->request_state != snapshot.request_state ||
                                        earlier_.first->response_state != snapshot.response_state);
  if (snapshot.request_state != 0 && snapshot.response_state != 0 && !moves &&
      now.steady < *earlier_.until) {
    earlier_.first = snapshot;
    return false;
  }
  if (earlier_.release && now.steady < earlier_.release->until && snapshot.response_state == 0 &&
      !moves) {
    return true;
  }
  earlier_ = {};
  return true;
}

bool Channel::released_late(const ServiceSnapshot& snapshot, Moment now) const {
  return earlier_.release && now.steady < earlier_.release->until && snapshot.request_state != 0 &&
         snapshot.response_state == earlier_.release->state &&
         call()->completion_signal == fabric::CompletionSignal::response_state &&
         std::ranges::count(call()->shown, snapshot.response_state) == 0;
}

SteadyTime Channel::next_read(Moment now) const {
  const bool soon = now.steady < reads_.active_until;
  return next_multiple(now.steady, reads_.notified ? intervals().subscribed
                                   : soon          ? intervals().active
                                                   : intervals().idle);
}

SteadyTime Channel::next_read_of_call(Moment now) const {
  return reads_.notified ? next_multiple(now.steady, intervals().subscribed)
                         : now.steady + intervals().idle;
}

void Channel::poll_call(const ServiceSnapshot& snapshot, Moment now) {
  OpenCall& call = std::get<OpenCall>(phase_);
  const RequestStatus status = call.on_snapshot(snapshot, now);
  if (call.may_show_interim(snapshot, status)) {
    reads_.due = now.steady + intervals().active;
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
  reads_.due = next_read_of_call(now);
  if (snapshot.set == ReadSet::request) {
    reads_.whole_due = now.steady + intervals().full;
    if (!call.verify(out_, now)) {
      end(false, base::messages::read_again(), now);
    }
  }
}

ReadSet Channel::poll_set(Moment now) const {
  if (const auto* const looking = std::get_if<RequestReader>(&phase_)) {
    return earlier_.until && !looking->reading() ? ReadSet::states : looking->reads();
  }
  if (const auto* const last = std::get_if<ReleasedCall>(&phase_)) {
    return last->answer.reads();
  }
  if (!open_call()->verified() || now.steady >= reads_.whole_due) {
    return ReadSet::request;
  }
  return call()->shown.empty() ? ReadSet::state : ReadSet::states;
}

void Channel::read(ReadSet set, Purpose purpose, Moment now) {
  io_.purpose = purpose;
  io_.read.asked = now.steady;
  out_.read(set);
}

void Channel::write(const Write& write, Moment now) {
  io_.purpose = Purpose::answer;
  out_.write(write, now);
}

void Channel::hold_off(const fabric::Message& reason, Moment now) {
  reads_.not_before = now.steady + intervals().retry;
  if (!reason.empty() && link_.error != reason && link_.up) {
    link_.error = reason;
    out_.log(Level::warn, reason);
  }
}

void Channel::publish_status(Moment now) {
  // A channel that is given up takes its problem with it.
  const bool watched = link_.up && (!leaving_ || has_work());
  const fabric::Message& problem = watched ? write_problem() : no_reason;
  out_.report_write_problem(problem);
  const OpenCall* const call = open_call();
  const auto* const found = std::get_if<Found>(&phase_);
  const auto* const looking =
      found != nullptr ? &found->reader : std::get_if<RequestReader>(&phase_);
  if (call == nullptr && leaving_ && leaving_->final_status) {
    return;
  }
  using enum fabric::ChannelState;
  ChannelView view;
  if (call != nullptr) {
    view = call->view();
  } else if (has_call()) {
    // The journal still has the call, and so does the gateway that takes over the channel.
    view.state = answering;
    view.uuid = released()->call->request.uuid;
    view.call = released()->call->id;
    static const fabric::Message release_not_seen = base::messages::release_not_seen();
    view.reason = &release_not_seen;
  } else if (looking != nullptr && looking->unserved()) {
    view.state = unserved;
    view.uuid = looking->unserved()->request.uuid;
    view.reason = &looking->unserved()->reason;
  } else if (link_.zero_seen) {
    view.state = idle;
  } else {
    // Idle is a word that other gateways rely on.
    static const fabric::Message beside_request = base::messages::response_state_beside_request();
    static const fabric::Message not_read_yet = base::messages::not_read_yet();
    view.reason = earlier_.first ? &beside_request : &not_read_yet;
  }
  if (!link_.up) {
    view.state = link_down;
    view.reason = &link_.down_reason;
  } else if (!link_.error.empty()) {
    view.reason = &link_.error;
  } else if (!problem.empty()) {
    view.reason = &problem;
  } else if (call != nullptr && call->waits_for_journal() && !out_.journal_error().empty()) {
    view.reason = &out_.journal_error();
  }
  out_.publish_status(view, now);
}

}  // namespace millrace::gateway::channel
