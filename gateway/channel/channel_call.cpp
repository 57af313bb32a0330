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

template <typename Act>
void Channel::with_call(Moment now, Act act) {
  if (call_) {
    ask_call(now, act);
  }
  finish(now);
}

void Channel::resume(CallRecord call, const Policy& policy) {
  assert(!link_up_ && !call_);
  call_ = OpenCall::resumed(std::move(call), policy);
}

void Channel::accept(fabric::CallId id, const Policy& policy, Moment now) {
  assert(found_ && !call_);
  unserved_.deadline_passed = false;
  CallRecord call;
  call.id = id;
  call.key = key();
  call.request = *std::exchange(found_, std::nullopt);
  call.seen = now.wall;
  ++out_.counters().calls;
  whole_due_ = now.steady + intervals_.full;
  publish_seen(call, now);
  call_ = OpenCall::accepted(std::move(call), policy, now.steady);
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
  if (!call_ || entry == 0) {
    return;
  }
  const bool fresh = now.steady - answer_read_at_ <= intervals_.max_age;
  with_call(now, [&](OpenCall& call) { call.on_recorded(entry, fresh, out_, now); });
}

void Channel::assign(const Assignment& assignment, Moment now) {
  with_call(now, [&](OpenCall& call) { call.assign(assignment, out_, now); });
}

void Channel::suspend(const fabric::Message& reason, bool held, Moment now) {
  with_call(now, [&](OpenCall& call) { call.suspend(reason, held, out_, now); });
}

void Channel::hold(const fabric::Message& reason, Moment now) {
  with_call(now, [&](OpenCall& call) { call.hold(reason, out_, now); });
}

void Channel::explain(const fabric::Message& reason, Moment now) {
  with_call(now, [&](OpenCall& call) { call.explain(reason); });
}

void Channel::answer_locally(const LocalAnswer& answer, Moment now) {
  with_call(now, [&](OpenCall& call) { call.answer_locally(answer, out_, now); });
}

void Channel::retry(const std::string& by, Moment now) {
  with_call(now, [&](OpenCall& call) { call.retry(by, out_); });
}

void Channel::on_reply(const fabric::Reply& reply, Moment now) {
  if (!call_ || reply.call != call_->id()) {
    late_reply(reply, now);
  } else if (!call_->call().asked(reply.instance)) {
    log_unassigned_reply(reply, "a call that was not dispatched to it", now);
  } else if (!call_->call().request.is_what(reply)) {
    log_unassigned_reply(reply, "another request with the same call id", now);
  } else {
    ask_call(now, [&](OpenCall& call) {
      if (!call.take(reply, out_, now)) {
        late_reply(reply, now);
      }
    });
  }
  finish(now);
}

/// An instance may send ten thousand replies a second, each to another call.
void Channel::log_unassigned_reply(const fabric::Reply& reply, std::string_view what, Moment now) {
  if (unassigned_logged_ && now.steady - *unassigned_logged_ < unassigned_pause) {
    return;
  }
  unassigned_logged_ = now.steady;
  out_.log(
      Level::warn,
      fmt::format(
          "call {}: instance {} replies to {}; the reply is dropped (logged at most every {} s)",
          reply.call.to_string(), reply.instance.to_string(), what, unassigned_pause.count()));
}

void Channel::late_reply(const fabric::Reply& reply, Moment now) {
  const bool in_hand = call_ && reply.call == call_->id();
  if (!in_hand && (!past_ || past_->call != reply.call ||
                   (past_->answered && past_->answered_by == reply.instance) ||
                   std::ranges::count(past_instances_, reply.instance) == 0)) {
    // Old samples of a service, a reply that was delivered twice, or one from an instance without a
    // request.
    return;
  }
  if (reply.kind == fabric::ReplyKind::declined) {
    // There is no answer that is lost.
    return;
  }
  if (late_replies_.call != reply.call) {
    late_replies_ = {reply.call, {}};
  }
  if (std::ranges::count(late_replies_.reported, reply.instance) > 0) {
    return;
  }
  late_replies_.reported.push_back(reply.instance);
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
  event.detail = in_hand || past_->answered ? base::messages::has_response()
                                            : base::messages::program_stopped_waiting();
  out_.log(Level::info,
           fmt::format("call {}: the reply of instance {} is too late: {}", reply.call.to_string(),
                       reply.instance.to_string(), event.detail));
  out_.publish(std::move(event), now);
}

bool Channel::drive_writer(Moment now) {
  if (!call_) {
    if (released_call_ && std::exchange(released_call_->write_again, false)) {
      io_ = Io::release;
      out_.write({released_call_->answer.variable(), released_call_->answer.value(), true});
      return true;
    }
    return false;
  }
  call_->begin_writing(out_);
  AnswerWriter* const writer = call_->writer();
  if (writer == nullptr) {
    return false;
  }
  writer->set_clearing(
      {.is_shown = effects_->clearing_is_shown && !intervals_.kernel_clears_request_state,
       .is_written = !intervals_.kernel_clears_request_state,
       .was_shown = effects_->clearing_was_shown()});
  const bool is_final = writer->kind() == AnswerWriter::Kind::final;
  switch (writer->next()) {
    case AnswerWriter::Step::read:
      if (now.steady < writer->read_at()) {
        out_.news().wake_at = writer->read_at();
      } else {
        read(writer->reads(), Io::answer, now);
      }
      return true;
    case AnswerWriter::Step::write_response:
      write(Variable::response, writer->text(), is_final && writer->text_last());
      return true;
    case AnswerWriter::Step::clear:
      write(Variable::request_state, std::uint32_t{0});
      return true;
    case AnswerWriter::Step::write_state:
      write(Variable::response_state, writer->state(), is_final && !writer->text_last());
      return true;
    case AnswerWriter::Step::record_clearing:
      if (call_->record_clearing(out_)) {
        due_ = now.steady + intervals_.idle;
      }
      return false;
    case AnswerWriter::Step::done:
    case AnswerWriter::Step::dropped:
      return false;
  }
  return false;
}

void Channel::answer_read(const ServiceSnapshot& snapshot, Moment now) {
  answer_read_at_ = now.steady;
  if (other_can_see(snapshot, now)) {
    leave_to_the_other(now);
    return;
  }
  const RequestStatus status = call_->on_snapshot(snapshot, now);
  if (call_->may_show_interim(snapshot, status) ||
      (!call_->writer()->may_be_released() && released_late(snapshot, now))) {
    call_->writer()->wait(now.steady);
    return;
  }
  const AnswerWriter::Step next = call_->on_read(snapshot, status, out_, read_time_);
  report_writer();
  if (next == AnswerWriter::Step::dropped) {
    end(false, end_reason(status, snapshot), now);
  } else {
    writer_finished(now);
  }
}

void Channel::report_writer() {
  AnswerWriter& writer = *call_->writer();
  if (const auto report = writer.take_report()) {
    out_.log(Level::warn, fmt::format("call {}: {}", call_->id().to_string(), *report));
  }
  if (const auto after = writer.take_shown_after()) {
    effects_->note_shown_after(*after);
  }
  if (!intervals_.kernel_clears_request_state && writer.kind() == AnswerWriter::Kind::final) {
    // Found with this response, until another one shows the contrary.
    bool& shown = effects_->clearing_is_shown;
    shown = (shown && writer.clearing_is_shown()) || writer.zero_seen();
    effects_->note_clearing(writer.clearing_was_shown());
  }
}

void Channel::release_written(WriteOutcome outcome, Moment now) {
  if (outcome == WriteOutcome::refused) {
    released_call_->answer.read_now();
  } else {
    released_call_->answer.on_written(now.steady);
  }
  due_ = now.steady;
}

bool Channel::release_is_over(const ServiceSnapshot& snapshot, Moment now) {
  Released& answer = released_call_->answer;
  if (snapshot.set != answer.reads()) {
    due_ = now.steady;  // it was asked before more was wanted
    return false;
  }
  switch (answer.on_read(snapshot, read_time_)) {
    case Released::Found::nothing:
      due_ = answer.read_at() ? *answer.read_at() : next_read(now);
      return false;
    case Released::Found::unreleased:
      released_call_->write_again = true;
      out_.log(answer.problem().empty() ? Level::info : Level::warn,
               fmt::format("call {}: no read has shown {} within {} ms: the write is lost, or the "
                           "NC program has reset the value already; it is written again",
                           released_call_->call.to_string(), name_of(answer.variable()),
                           takes_effect.count()));
      return false;
    case Released::Found::idle:
    case Released::Found::request:
      break;
  }
  if (released_call_->open) {
    out_.append_untracked(EndedEntry{released_call_->call});
  }
  unseen_release_.reset();
  if (const auto until = answer.unseen_until(); until && now.steady < *until) {
    unseen_release_ = {std::get<std::uint32_t>(answer.value()), *until};
    unknown_until_ = *until;
  }
  released_call_.reset();
  zero_seen_ = true;
  return true;
}

const fabric::Message& Channel::write_problem() {
  if (call_) {
    const AnswerWriter* const writer = call_->writer();
    return writer != nullptr ? writer->problem() : no_reason;
  }
  return released_call_ ? released_call_->answer.problem() : no_reason;
}

void Channel::writer_finished(Moment now) {
  const AnswerWriter& writer = *call_->writer();
  if (writer.next() != AnswerWriter::Step::done) {
    return;
  }
  if (writer.kind() == AnswerWriter::Kind::final) {
    end(true, no_reason, now);
  } else {
    call_->interim_written(out_, now);
    due_ = now.steady;
  }
}

void Channel::end(bool written, const fabric::Message& detail, Moment now) {
  past_instances_.clear();
  for (const Attempt& attempt : call_->call().attempts) {
    past_instances_.push_back(attempt.instance);
  }
  const AnswerWriter* const writer = call_->writer();
  const bool open = written && writer != nullptr && !writer->zero_seen();
  if (writer != nullptr && writer->clearing_took_long()) {
    effects_->doubt_clearing();
  }
  if (written && writer != nullptr) {
    released_call_ = ReleasedCall{Released(call_->call().request, *writer), call_->id(), open};
  } else {
    released_call_.reset();
  }
  past_ = call_->close(written, !open, detail, out_, now);
  call_.reset();
  unknown_until_.reset();
  unseen_release_.reset();
  zero_seen_ = !open;
  reader_.restart();
  due_ = now.steady;
  active_until_ = now.steady + intervals_.after_answer_for;
}

bool Channel::other_can_see(const ServiceSnapshot& snapshot, Moment now) const {
  return !handed_over_.empty() && !call_->call().clearing && !call_->interim_is_fresh(now) &&
         snapshot.has(Variable::request_state) && snapshot.request_state != 0;
}

void Channel::leave_to_the_other(Moment now) {
  final_status_ = may_be_assigned();
  end(false, handed_over_, now);
}

}  // namespace millrace::gateway::channel
