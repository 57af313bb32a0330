// The responses of an open call: from its service, from an operator or a policy, and until they are
// stored.
#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/messages.hpp"
#include "gateway/channel/open_call.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::channel {

namespace {

/// "30 s", "1.5 s"
std::string seconds(std::chrono::milliseconds time) {
  return fmt::format("{:g} s", std::chrono::duration<double>(time).count());
}

bool over(const std::optional<Rule>& rule, const std::optional<SteadyTime>& since, Moment now) {
  return rule && since && now.steady - *since >= rule->after;
}

/// A RESPONSE_STATE that stands beside the request, and so does not answer it, although we have not
/// written it: an interim state of another gateway, or what an earlier call has left.
bool stands_beside(const ServiceSnapshot& snapshot, const CallRecord& call) {
  return snapshot.request_state != 0 && snapshot.response_state != 0 &&
         std::ranges::count(call.shown, snapshot.response_state) == 0;
}

/// How long the parts of the way of a call took, as far as its service says times; empty if not.
std::string hops_of(const CallRecord& call, const fabric::Reply& reply, Moment now) {
  const std::array times{call.seen, reply.received, reply.started, reply.answered, now.wall};
  if (std::ranges::count(times, fabric::Time{}) > 0) {
    return {};
  }
  // A service of another make may say any time: in floating point no difference overflows.
  const auto hop = [&times](std::size_t from) {
    using Milliseconds = std::chrono::duration<double, std::milli>;
    return (Milliseconds(times[from + 1].time_since_epoch()) -
            Milliseconds(times[from].time_since_epoch()))
        .count();
  };
  return fmt::format(
      "{:.2f} ms until the service had it, {:.2f} ms in its queue, {:.2f} ms of work, {:.2f} ms "
      "back",
      hop(0), hop(1), hop(2), hop(3));
}

}  // namespace

bool OpenCall::take(const fabric::Reply& reply, ChannelOutput& out, Moment now) {
  if (call_->answer) {
    return call_->answer->instance == reply.instance;
  }
  if (!fabric::is_known(reply)) {
    take_final(reply, out, now);
    return true;
  }
  switch (reply.kind) {
    case fabric::ReplyKind::interim:
      take_interim(reply, out);
      break;
    case fabric::ReplyKind::final:
      take_final(reply, out, now);
      break;
    case fabric::ReplyKind::declined:
      take_decline(reply, out);
      break;
  }
  return true;
}

/// Only the present attempt can be declined, and only while it is pending.
void OpenCall::take_decline(const fabric::Reply& reply, ChannelOutput& out) {
  const auto* const running = std::get_if<phase::Running>(&phase_);
  if (running == nullptr || running->to.attempt != Attempt{reply.instance, reply.attempt}) {
    return;
  }
  const fabric::Message why = base::messages::declined(
      running->to.instance_name(), reply.reason.empty() ? fabric::Message(printable(reply.text))
                                                        : printable_message(reply.reason));
  out.log(Level::debug, fmt::format("{}: {}", name(), why));
  enter(phase::Waiting{}, why);
  out.news().declined = call_->id;
}

void OpenCall::take_interim(const fabric::Reply& reply, ChannelOutput& out) {
  const Assignment* const to = assignment();
  if (to == nullptr || to->attempt.instance != reply.instance) {
    return;
  }
  auto response = Response::of(reply.text, reply.state);
  if (response && call_->completion_signal == fabric::CompletionSignal::response) {
    response =
        tl::unexpected(fabric::Message("would release the NC program, which waits for RESPONSE and "
                                       "does not check RESPONSE_STATE"));
  }
  if (response) {
    interim_.next = *std::move(response);
  } else {
    // A service that reports progress does so often.
    out.log(std::exchange(interim_.refused, true) ? Level::debug : Level::warn,
            fmt::format("{}: an interim answer {}; it is not written", name(), response.error()));
  }
}

void OpenCall::take_final(const fabric::Reply& reply, ChannelOutput& out, Moment now) {
  const Attempt attempt{reply.instance, reply.attempt};
  const Refused refusal{attempt, reply.answered};
  if (std::ranges::count(refused_, refusal) > 0) {
    return;
  }
  auto response = fabric::is_known(reply)
                      ? Response::of(reply.text, reply.state, call_->completion_signal)
                      : tl::unexpected(base::messages::response_of_unknown_kind());
  if (!response || reply.code == fabric::ServiceCode::refused) {
    // While the call is blocked, any number may come.
    refused_.push_back(refusal);
    if (refused_.size() > most_refused) {
      refused_.erase(refused_.begin());
    }
  }
  if (!response) {
    const fabric::Message what = base::messages::answer_of_service(response.error());
    refuse(attempt, what, Response::in_words("ERROR: " + what.text, refused_state), out, now);
    return;
  }
  if (reply.code == fabric::ServiceCode::refused) {
    // The service's library found the mistake, and replaced the answer with an error.
    refuse(attempt, base::messages::answer_unwritable(printable(reply.text)), *response, out, now);
    return;
  }
  if (reply.code == fabric::ServiceCode::failed) {
    ++out.counters().failed;
    out.log(Level::warn, fmt::format("{}: the service failed: {}", name(), printable(reply.text)));
  }
  if (out.wanted(Level::debug)) {
    if (const std::string hops = hops_of(*call_, reply, now); !hops.empty()) {
      out.log(Level::debug, fmt::format("{}: {}", name(), hops));
    }
  }
  take_answer(attempt, *std::move(response), {}, out, now);
}

void OpenCall::refuse(const Attempt& of, const fabric::Message& what, Response instead,
                      ChannelOutput& out, Moment now) {
  ++out.counters().failed;
  const bool hold = policy_.refused && policy_.refused->response_state == 0;
  if (policy_.refused && !hold) {
    instead = Response::in_words(instead.text(), policy_.refused->response_state);
  }
  const fabric::Message detail = hold ? base::messages::refused_held(what)
                                      : base::messages::refused_with_state(what, instead.state());
  publish_event(fabric::EventKind::refused, of, detail, out, now);
  out.log(Level::error, fmt::format("{}: {}", name(), detail));
  if (hold) {
    enter(phase::Held{unconfirmed_attempt(), {}}, detail);
    out.end(call_->id);
  } else {
    take_answer(of, std::move(instead), detail, out, now);
  }
}

void OpenCall::take_answer(const Attempt& of, Response response, const fabric::Message& detail,
                           ChannelOutput& out, Moment now) {
  publish_event(fabric::EventKind::replied, of, detail, out, now, response.text(),
                response.state());
  call_->answer = Answer{of.instance, of.number, response.text(), response.state()};
  interim_.next.reset();
  if (std::holds_alternative<Interim>(interim_.current)) {
    // One that is half written comes to its end first, or to its next read (begin_writing).
    interim_.current = std::monostate{};
  }
  const EntryNumber entry = out.append(AnsweredEntry{call_->id, *call_->answer});
  enter(phase::Answered{std::move(response), entry});
  out.end(call_->id);
}

void OpenCall::answer_locally(const LocalAnswer& answer, ChannelOutput& out, Moment now) {
  if (answered()) {
    return;
  }
  if (call_->attempts.empty()) {
    // Opens it in the journal although it was not dispatched.
    out.append_untracked(call_->dispatched({{}, 0}));
  }
  const Response& response = answer.response;
  out.log(Level::warn, fmt::format("{} is answered by {} with state {}: {}", name(), answer.by,
                                   response.state(), printable(response.text())));
  const std::uint32_t attempt = call_->attempts.empty() ? 0 : call_->attempts.back().number;
  take_answer({fabric::InstanceId{}, attempt}, response, base::messages::answered_by(answer.by),
              out, now);
}

void OpenCall::check_deadlines(ChannelOutput& out, Moment now) {
  if (answered() || !verified()) {
    return;
  }
  auto* const held = std::get_if<phase::Held>(&phase_);
  if (held != nullptr && over(policy_.lost, held->lost_since, now)) {
    held->lost_since.reset();
    give_up(*policy_.lost, "its instance is lost, and the call must not run twice",
            base::messages::held_too_long(reason_), out, now);
  } else if (!age_.overdue && over(policy_.deadline, age_.since, now)) {
    age_.overdue = true;
    const std::string time = seconds(policy_.deadline->after);
    give_up(*policy_.deadline, fmt::format("no response within {}", time),
            base::messages::deadline(time), out, now);
  }
}

void OpenCall::give_up(const Rule& rule, std::string_view response, const fabric::Message& why,
                       ChannelOutput& out, Moment now) {
  if (rule.response_state != 0) {
    answer_locally({Response::in_words(fmt::format("millrace: {}", response), rule.response_state),
                    base::messages::the_gateway()},
                   out, now);
    return;
  }
  reason_ = why;
  publish_event(fabric::EventKind::late, newest_attempt(), why, out, now);
  out.log(Level::warn, fmt::format("{}: {}", name(), why));
}

void OpenCall::begin_writing(bool text_is_own, ChannelOutput& out) {
  if (const auto* const writer = std::get_if<AnswerWriter>(&interim_.current);
      writer != nullptr && answered() && writer->may_be_dropped()) {
    interim_.current = std::monostate{};
  }
  if (!text_is_own) {
    return;
  }
  if (auto* const interim = std::get_if<Interim>(&interim_.current)) {
    if (interim->entry == 0) {
      call_->shown.push_back(interim->response.state());
      interim_.current = AnswerWriter(AnswerWriter::Kind::interim, std::move(interim->response));
    }
  } else if (interim_.next && !interim_.unseen &&
             std::holds_alternative<std::monostate>(interim_.current)) {
    const EntryNumber entry = out.append(InterimEntry{call_->id, interim_.next->state()});
    interim_.current = Interim{*std::exchange(interim_.next, std::nullopt), entry};
  }
}

AnswerWriter* OpenCall::writer() {
  if (auto* const interim = std::get_if<AnswerWriter>(&interim_.current)) {
    return interim;
  }
  // The state of an interim answer that takes effect now could undo what the final one writes.
  auto* const writing = std::get_if<phase::Writing>(&phase_);
  return writing != nullptr && !interim_.unseen ? &writing->writer : nullptr;
}

AnswerWriter::Step OpenCall::on_read(const ServiceSnapshot& snapshot, RequestStatus status,
                                     ChannelOutput& out, const ReadTime& time) {
  if (status == RequestStatus::pending && stands_beside(snapshot, *call_)) {
    // Once REQUEST_STATE is cleared, it must not be taken for another writer's response.
    call_->shown.push_back(snapshot.response_state);
    out.append_untracked(InterimEntry{call_->id, snapshot.response_state});
  }
  return writer()->on_read(snapshot, status, call_->request, time);
}

RequestStatus OpenCall::on_snapshot(const ServiceSnapshot& snapshot, Moment now) {
  if (interim_.unseen && snapshot.has(Variable::response_state)) {
    if (snapshot.response_state == call_->shown.back()) {
      // Those before it are overwritten.
      call_->shown.assign(1, snapshot.response_state);
      interim_.unseen = false;
    } else if (now.steady - *interim_.at >= takes_effect) {
      interim_.unseen = false;
    }
  }
  zero_seen_ = zero_seen_ || snapshot.request_state == 0;
  return zero_seen_ && snapshot.request_state != 0
             ? RequestStatus::replaced
             : compare(snapshot, call_->request, call_->shown);
}

bool OpenCall::may_show_interim(const ServiceSnapshot& snapshot, RequestStatus status) const {
  const bool same_texts =
      !snapshot.has(Variable::uuid) ||
      (snapshot.uuid == call_->request.uuid && snapshot.request == call_->request.text);
  return interim_.unseen && status == RequestStatus::withdrawn && same_texts;
}

bool OpenCall::record_clearing(ChannelOutput& out) {
  auto* const writing = std::get_if<phase::Writing>(&phase_);
  if (writing == nullptr || writing->clearing != 0) {
    return false;
  }
  writing->clearing = out.append(ClearingEntry{call_->id});
  return true;
}

void OpenCall::interim_written(ChannelOutput& out, Moment now) {
  const auto& writer = std::get<AnswerWriter>(interim_.current);
  publish_event(fabric::EventKind::interim, {{}, 0}, {}, out, now, writer.text(), writer.state());
  interim_.at = now.steady;
  interim_.unseen = true;
  interim_.current = std::monostate{};
}

}  // namespace millrace::gateway::channel
