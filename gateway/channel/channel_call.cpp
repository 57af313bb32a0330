// The call of a channel, as the channel sees it: accepted, answered, over.
#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "gateway/channel/channel.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::channel {

namespace {

/// Between two lines about instances that reply without a request.
constexpr std::chrono::seconds unassigned_pause{10};

}  // namespace

void Channel::resume(CallRecord call, const Policy& policy) {
  assert(!link_.up && open_call() == nullptr);
  phase_ = OpenCall::resumed(std::move(call), policy);
}

void Channel::accept(fabric::CallId id, const Policy& policy, Moment now) {
  CallRecord call;
  call.id = id;
  call.key = key();
  call.request = std::move(std::get<Found>(phase_).request);
  call.seen = now.wall;
  ++out_.counters().calls;
  reads_.whole_due = now.steady + intervals().full;
  publish_seen(call, now);
  phase_ = OpenCall::accepted(std::move(call), policy, now.steady);
  finish(now);
}

void Channel::publish_seen(const CallRecord& call, Moment now) {
  if (out_.events_wanted()) {
    fabric::Event event;
    event.kind = fabric::EventKind::seen;
    event.call = call.id;
    event.uuid = call.request.uuid;
    event.text = call.request.text;
    event.state = call.request.state;
    out_.publish(std::move(event), now);
  }
  if (out_.wanted(Level::debug)) {
    out_.log(Level::debug, fmt::format("call {} seen: {} \"{}\", state {}", call.id.to_string(),
                                       printable(call.request.uuid), printable(call.request.text),
                                       call.request.state));
  }
}

void Channel::on_recorded(EntryNumber entry, Moment now) {
  if (open_call() == nullptr || entry == 0) {
    return;
  }
  const bool fresh = now.steady - io_.answer_read <= intervals().max_age;
  change_call(
      now, [&](OpenCall& call, ChannelOutput& out) { call.on_recorded(entry, fresh, out, now); });
}

void Channel::on_reply(const fabric::Reply& reply, Moment now) {
  OpenCall* const open = open_call();
  if (open == nullptr || reply.call != open->id()) {
    late_reply(reply, now);
  } else if (!open->call()->asked(reply.instance)) {
    log_unassigned_reply(reply, "a call that was not dispatched to it", now);
  } else if (!open->call()->request.is_what(reply)) {
    log_unassigned_reply(reply, "another request with the same call id", now);
  } else {
    ask(*open, now, [&](OpenCall& call) {
      if (!call.take(reply, out_, now)) {
        late_reply(reply, now);
      }
    });
  }
  finish(now);
}

/// An instance may send ten thousand replies a second, each to another call.
void Channel::log_unassigned_reply(const fabric::Reply& reply, std::string_view what, Moment now) {
  if (past_.unassigned_logged && now.steady - *past_.unassigned_logged < unassigned_pause) {
    return;
  }
  past_.unassigned_logged = now.steady;
  out_.log(
      Level::warn,
      fmt::format(
          "call {}: instance {} replies to {}; the reply is dropped (logged at most every {} s)",
          reply.call.to_string(), reply.instance.to_string(), what, unassigned_pause.count()));
}

void Channel::late_reply(const fabric::Reply& reply, Moment now) {
  const bool in_hand = call() != nullptr && reply.call == call()->id;
  const auto& past = past_.call;
  if (!in_hand && (!past || past->call->id != reply.call ||
                   (past->answered && past->call->answer->instance == reply.instance) ||
                   !past->call->asked(reply.instance))) {
    // Old samples of a service, a reply that was delivered twice, or one from an instance without a
    // request.
    return;
  }
  if (reply.kind == fabric::ReplyKind::declined) {
    // There is no answer that is lost.
    return;
  }
  if (past_.reported_call != reply.call) {
    past_.reported_call = reply.call;
    past_.reported.clear();
  }
  if (std::ranges::count(past_.reported, reply.instance) > 0) {
    return;
  }
  past_.reported.push_back(reply.instance);
  ++out_.counters().late;
  fabric::Event event;
  event.kind = fabric::EventKind::late;
  event.call = reply.call;
  event.attempt = reply.attempt;
  event.instance = reply.instance;
  if (const auto response = Response::of(reply.text, reply.state)) {
    event.text = response->text();
    event.state = response->state();
  }
  event.detail = in_hand || past->answered ? base::messages::has_response()
                                           : base::messages::program_stopped_waiting();
  out_.log(Level::info,
           fmt::format("call {}: the reply of instance {} is too late: {}", reply.call.to_string(),
                       reply.instance.to_string(), event.detail));
  out_.publish(std::move(event), now);
}

bool Channel::drive_writer(Moment now) {
  if (ReleasedCall* const last = released(); last && std::exchange(last->write_again, false)) {
    io_.purpose = Purpose::release;
    out_.write({last->answer.variable(), last->answer.value(), true}, now);
    return true;
  }
  OpenCall* const call = open_call();
  if (call == nullptr) {
    return false;
  }
  const bool text_is_own = link_.zero_seen || now.steady >= link_.strange_writes_until;
  call->begin_writing(text_is_own, out_);
  if (!text_is_own) {
    reads_.due = std::min(reads_.due, link_.strange_writes_until);
  }
  AnswerWriter* const writer = call->writer();
  if (writer == nullptr) {
    return false;
  }
  const bool clears = intervals().kernel_clears_request_state;
  writer->set_clearing(
      {.most = clears ? 0 : controller_.effects.most_clearings(), .is_written = !clears});
  const bool is_final = writer->kind() == AnswerWriter::Kind::final;
  switch (writer->next()) {
    case AnswerWriter::Step::read:
      if (now.steady < writer->read_at()) {
        out_.news().wake_at = writer->read_at();
      } else {
        read(writer->reads(), Purpose::answer, now);
      }
      return true;
    case AnswerWriter::Step::write_response:
      write({Variable::response, writer->text(), is_final && writer->text_last()}, now);
      return true;
    case AnswerWriter::Step::clear:
      write({Variable::request_state, std::uint32_t{0}}, now);
      return true;
    case AnswerWriter::Step::write_state:
      write({Variable::response_state, writer->state(), is_final && !writer->text_last()}, now);
      return true;
    case AnswerWriter::Step::record_clearing:
      if (call->record_clearing(out_)) {
        reads_.due = now.steady + intervals().idle;
      }
      return false;
    case AnswerWriter::Step::done:
    case AnswerWriter::Step::dropped:
      return false;
  }
  return false;
}

void Channel::answer_read(const ServiceSnapshot& snapshot, Moment now) {
  io_.answer_read = now.steady;
  if (other_can_see(snapshot, now)) {
    leave_to_the_other(now);
    return;
  }
  OpenCall& call = std::get<OpenCall>(phase_);
  const RequestStatus status = call.on_snapshot(snapshot, now);
  if (call.may_show_interim(snapshot, status) ||
      (!writer()->may_be_released() && released_late(snapshot, now))) {
    writer()->wait(now.steady);
    return;
  }
  const AnswerWriter::Step next = call.on_read(snapshot, status, out_, io_.read);
  report_writer();
  if (next == AnswerWriter::Step::dropped) {
    end(false, end_reason(status, snapshot), now);
  } else {
    writer_finished(now);
  }
}

void Channel::report_writer() {
  AnswerWriter& writer = *this->writer();
  if (const auto report = writer.take_report()) {
    out_.log(Level::warn, fmt::format("call {}: {}", call()->id.to_string(), *report));
  }
  if (const auto after = writer.take_shown_after()) {
    controller_.effects.note_shown_after(*after);
  }
  if (writer.clearing_was_shown()) {
    controller_.effects.note_clearing_shown();
  }
}

void Channel::release_written(WriteOutcome outcome, Moment now) {
  Released& answer = released()->answer;
  outcome == WriteOutcome::refused ? answer.read_now() : answer.on_written(now.steady);
  reads_.due = now.steady;
}

bool Channel::release_is_over(const ServiceSnapshot& snapshot, Moment now) {
  ReleasedCall& last = *released();
  Released& answer = last.answer;
  if (snapshot.set != answer.reads()) {
    reads_.due = now.steady;  // it was asked before more was wanted
    return false;
  }
  switch (answer.on_read(snapshot, io_.read)) {
    case Released::Found::nothing:
      reads_.due = answer.read_at() ? *answer.read_at() : next_read(now);
      return false;
    case Released::Found::unreleased:
      last.write_again = true;
      out_.log(
          answer.problem().empty() ? Level::info : Level::warn,
          fmt::format("call {}: no read has shown {} within {} ms: the write is lost, or the "
                      "NC program has reset the value already; it is written again",
                      last.call->id.to_string(), name_of(answer.variable()), takes_effect.count()));
      return false;
    case Released::Found::idle:
    case Released::Found::request:
      break;
  }
  if (last.open) {
    out_.append_untracked(EndedEntry{last.call->id});
  }
  earlier_.release.reset();
  if (const auto until = answer.unseen_until(); until && now.steady < *until) {
    earlier_.release = {std::get<std::uint32_t>(answer.value()), *until};
    earlier_.until = *until;
  }
  phase_ = RequestReader();
  link_.zero_seen = true;
  return true;
}

const fabric::Message& Channel::write_problem() {
  if (const AnswerWriter* const writing = writer()) {
    return writing->problem();
  }
  return released() != nullptr ? released()->answer.problem() : no_reason;
}

void Channel::writer_finished(Moment now) {
  if (writer()->next() != AnswerWriter::Step::done) {
    return;
  }
  if (writer()->kind() == AnswerWriter::Kind::final) {
    end(true, no_reason, now);
  } else {
    std::get<OpenCall>(phase_).interim_written(out_, now);
    reads_.due = now.steady;
  }
}

void Channel::end(bool written, const fabric::Message& detail, Moment now) {
  OpenCall& call = std::get<OpenCall>(phase_);
  AnswerWriter* const writer = call.writer();
  const bool open = written && !writer->zero_seen();
  if (writer != nullptr && writer->zero_seen()) {
    controller_.effects.note_zero();
  } else if (writer != nullptr && writer->does_without_clearing()) {
    controller_.effects.note_clearing_unshown();
  }
  if (writer != nullptr && writer->clearing_took_long()) {
    controller_.effects.doubt_clearing();
  }
  past_.call = call.close(written, !open, detail, out_, now);
  if (written) {
    phase_ = ReleasedCall{Released(call.call()->request, std::move(*writer)), call.call(), open};
  } else {
    phase_ = RequestReader();
  }
  earlier_ = {};
  link_.zero_seen = !open;
  reads_.due = now.steady;
  reads_.active_until = now.steady + intervals().active_for;
}

bool Channel::has_call() const {
  const auto* const last = std::get_if<ReleasedCall>(&phase_);
  return open_call() != nullptr || (last != nullptr && last->open);
}

bool Channel::has_work() const {
  const auto* const last = std::get_if<ReleasedCall>(&phase_);
  return has_call() || (last != nullptr && link_.up && last->answer.problem().empty());
}

bool Channel::other_can_see(const ServiceSnapshot& snapshot, Moment now) const {
  return leaving_ && !leaving_->handed_over.empty() && !call()->clearing &&
         !open_call()->interim_is_fresh(now) && snapshot.has(Variable::request_state) &&
         snapshot.request_state != 0;
}

void Channel::leave_to_the_other(Moment now) {
  leaving_->final_status = may_be_assigned();
  end(false, leaving_->handed_over, now);
}

}  // namespace millrace::gateway::channel
