#include "gateway/channel/open_call.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"
#include "fabric/cases.hpp"
#include "gateway/text.hpp"

namespace millrace::gateway::channel {

namespace {

using fabric::Cases;

std::string after(std::chrono::nanoseconds time) {
  return fmt::format(" after {:.1f} ms", std::chrono::duration<double, std::milli>(time).count());
}

}  // namespace

OpenCall OpenCall::accepted(CallRecord call, const Policy& policy, SteadyTime now) {
  OpenCall open(std::move(call), policy, phase::Waiting{});
  open.age_.since = now;
  open.age_.known = true;
  return open;
}

OpenCall OpenCall::resumed(CallRecord call, const Policy& policy) {
  Phase phase = phase::Unverified{};
  if (call.answer) {
    if (auto response =
            Response::of(call.answer->text, call.answer->state, call.completion_signal)) {
      // Its own reads find out whether the program still waits.
      phase = phase::Writing{
          AnswerWriter::resumed(*std::move(response), call.clearing, call.completion_signal,
                                std::ranges::count(call.shown, call.answer->state) > 0)};
    } else {
      phase = phase::Unverified{std::exchange(call.answer, std::nullopt)};
      call.clearing = false;
    }
  }
  OpenCall open(std::move(call), policy, std::move(phase));
  for (const Attempt& attempt : open.call_->attempts) {
    // An attempt of 0 is a call that was answered instead of the service.
    if (attempt.number > 0 && std::ranges::count(open.asked_, attempt.instance) == 0) {
      open.asked_.push_back(attempt.instance);
    }
  }
  open.reason_ = base::messages::resumed();
  return open;
}

void OpenCall::enter(Phase phase, fabric::Message reason) {
  phase_ = std::move(phase);
  reason_ = std::move(reason);
}

bool OpenCall::may_be_assigned() const {
  // A blocked call was dispatched by an earlier gateway, if not by this one.
  return !call_->attempts.empty() || std::holds_alternative<phase::Held>(phase_) ||
         call_->delivery == fabric::Delivery::at_most_once;
}

const Assignment* OpenCall::assignment() const {
  if (const auto* assigned = std::get_if<phase::Assigned>(&phase_)) {
    return &assigned->to;
  }
  const auto* running = std::get_if<phase::Running>(&phase_);
  return running != nullptr ? &running->to : nullptr;
}

bool OpenCall::waits_for_journal() const {
  const auto* const writing = std::get_if<phase::Writing>(&phase_);
  return std::holds_alternative<phase::Assigned>(phase_) ||
         std::holds_alternative<phase::Answered>(phase_) ||
         (writing != nullptr && writing->clearing != 0);
}

ChannelView OpenCall::view() const {
  using enum fabric::ChannelState;
  ChannelView view;
  view.state = std::visit(Cases{
                              [](const phase::Unverified&) { return waiting; },
                              [](const phase::Waiting&) { return waiting; },
                              [](const phase::Assigned&) { return running; },
                              [](const phase::Running&) { return running; },
                              [](const phase::Held&) { return held; },
                              [](const phase::Answered&) { return answering; },
                              [](const phase::Writing&) { return answering; },
                          },
                          phase_);
  view.reason = &reason_;
  view.uuid = call_->request.uuid;
  view.call = call_->id;
  view.attempt = call_->attempts.empty() ? 0 : call_->attempts.back().number;
  if (call_->answer) {
    view.instance = call_->answer->instance;
  } else if (const Assignment* const to = assignment()) {
    view.instance = to->attempt.instance;
  }
  return view;
}

void OpenCall::on_link_up(Moment now) {
  if (!age_.since) {
    // The wall clock may have been set since; a call is never older than the gateway's clock.
    const std::chrono::nanoseconds age = now.wall - call_->seen;
    age_.since = now.steady - std::max(age, std::chrono::nanoseconds(0));
    age_.known = age >= std::chrono::nanoseconds(0);
  }
}

bool OpenCall::verify(ChannelOutput& out, Moment now) {
  auto* const unverified = std::get_if<phase::Unverified>(&phase_);
  if (unverified == nullptr) {
    return true;
  }
  if (call_->attempts.back().number == 0 && call_->delivery == fabric::Delivery::at_least_once) {
    // It was about to be answered instead of the service.
    return false;
  }
  const auto unwritable = std::move(unverified->unwritable);
  phase_ = phase::Waiting{};
  if (unwritable) {
    const fabric::Message what = base::messages::answer_in_journal(
        Response::of(unwritable->text, unwritable->state, call_->completion_signal).error());
    refuse({unwritable->instance, unwritable->attempt}, what,
           Response::in_words("ERROR: " + what.text, refused_state), out, now);
  } else {
    out.news().resumed = true;
  }
  return true;
}

EntryNumber OpenCall::unconfirmed_attempt() const {
  return std::visit(Cases{
                        [](const phase::Waiting& waiting) { return waiting.entry; },
                        [](const phase::Assigned& assigned) { return assigned.entry; },
                        [](const phase::Held& held) { return held.entry; },
                        [](const auto&) { return EntryNumber{0}; },
                    },
                    phase_);
}

void OpenCall::assign(const Assignment& to, ChannelOutput& out, Moment now) {
  if (answered()) {
    return;
  }
  EntryNumber entry = unconfirmed_attempt();
  if (call_->attempts.empty() || call_->attempts.back() != to.attempt) {
    call_->attempts.push_back(to.attempt);
    // Refused under this number was an answer to an attempt that the journal has lost with the
    // power; the same answer again would be one to this.
    std::erase_if(refused_, [&](const Refused& refused) { return refused.of == to.attempt; });
    call_->delivery = to.delivery;
    call_->completion_signal = to.completion_signal;
    out.counters().repeated += call_->attempts.size() > 1 ? 1U : 0U;
    entry = out.append(call_->dispatched(to.attempt));
  }
  if (entry != 0) {
    enter(phase::Assigned{to, entry});
  } else {
    enter(phase::Running{to});
    publish(to, out, now);
  }
}

void OpenCall::suspend(const fabric::Message& reason, bool held, ChannelOutput& out, Moment now) {
  if (answered()) {
    return;
  }
  publish_event(fabric::EventKind::lost, newest_attempt(), reason, out, now);
  if (held) {
    publish_event(fabric::EventKind::held, newest_attempt(), reason, out, now);
  }
  out.log(Level::warn, fmt::format("{}: {}", name(), reason));
  const EntryNumber entry = unconfirmed_attempt();
  held ? enter(phase::Held{entry, now.steady}, reason) : enter(phase::Waiting{entry}, reason);
}

void OpenCall::hold(const fabric::Message& reason, ChannelOutput& out, Moment now) {
  call_->delivery = fabric::Delivery::at_most_once;
  out.append_untracked(call_->dispatched({{}, 0}));
  suspend(reason, true, out, now);
}

void OpenCall::explain(const fabric::Message& reason) {
  if (std::holds_alternative<phase::Waiting>(phase_)) {
    reason_ = reason;
  }
}

void OpenCall::retry(const std::string& by, ChannelOutput& out) {
  if (answered()) {
    return;
  }
  enter(phase::Waiting{unconfirmed_attempt()}, base::messages::dispatched_again(by));
  out.log(Level::info, fmt::format("{}: {}", name(), reason_));
}

void OpenCall::on_recorded(EntryNumber recorded, bool read_is_fresh, ChannelOutput& out,
                           Moment now) {
  if (auto* const interim = std::get_if<Interim>(&interim_.current);
      interim != nullptr && interim->entry == recorded) {
    interim->entry = 0;
    return;
  }
  const auto confirm = [recorded](EntryNumber& entry) { entry = entry == recorded ? 0 : entry; };
  if (const auto* assigned = std::get_if<phase::Assigned>(&phase_)) {
    if (assigned->entry == recorded) {
      enter(phase::Running{Assignment(assigned->to)});
      publish(std::get<phase::Running>(phase_).to, out, now);
    }
  } else if (auto* const waiting = std::get_if<phase::Waiting>(&phase_)) {
    confirm(waiting->entry);
  } else if (auto* const held = std::get_if<phase::Held>(&phase_)) {
    confirm(held->entry);
  } else if (auto* const known = std::get_if<phase::Answered>(&phase_)) {
    if (known->entry == recorded) {
      const bool stood = std::ranges::count(call_->shown, known->answer.state()) > 0;
      enter(phase::Writing{AnswerWriter(AnswerWriter::Kind::final, std::move(known->answer),
                                        call_->completion_signal, stood)});
    }
  } else if (auto* const writing = std::get_if<phase::Writing>(&phase_)) {
    if (writing->clearing == recorded) {
      writing->clearing = 0;
      call_->clearing = true;
      if (writing->writer.next() == AnswerWriter::Step::record_clearing) {
        writing->writer.on_recorded(read_is_fresh);
      }
    }
  }
}

void OpenCall::publish(const Assignment& to, ChannelOutput& out, Moment now) {
  // The earlier instances do not hear of this.
  for (const fabric::InstanceId& instance : std::exchange(asked_, {to.attempt.instance})) {
    if (instance != to.attempt.instance) {
      out.withdraw(instance, call_->id);
    }
  }
  fabric::Request request;
  request.key = call_->key;
  request.call = call_->id;
  request.attempt = to.attempt.number;
  request.assigned = to.attempt.instance;
  request.uuid = call_->request.uuid;
  request.text = call_->request.text;
  request.state = call_->request.state;
  if (policy_.deadline) {
    request.deadline = call_->seen + policy_.deadline->after;
  }
  request.seen = call_->seen;
  request.dispatched = now.wall;
  request.may_wait = to.waits;
  out.publish(std::move(request));
  publish_event(fabric::EventKind::dispatched, newest_attempt(), to.instance_name(), out, now);
  if (out.wanted(Level::debug)) {
    out.log(Level::debug, fmt::format("{} given to {}, attempt {}", name(), to.instance_name(),
                                      to.attempt.number));
  }
}

EndedCall OpenCall::close(bool written, bool over, const fabric::Message& detail,
                          ChannelOutput& out, Moment now) {
  assert(!written || answered());
  if (over) {
    out.append_untracked(EndedEntry{call_->id});
  }
  const AnswerWriter* const final = writer();
  const bool may_be_written = !written && final != nullptr &&
                              final->kind() == AnswerWriter::Kind::final &&
                              final->may_be_released();
  if (written || may_be_written) {
    publish_event(fabric::EventKind::written,
                  Attempt{call_->answer->instance, call_->answer->attempt},
                  may_be_written ? base::messages::may_have_response(detail) : detail, out, now,
                  call_->answer->text, call_->answer->state);
  } else {
    publish_event(fabric::EventKind::withdrawn, newest_attempt(), detail, out, now);
  }
  for (const fabric::InstanceId& instance : asked_) {
    // The other instances that got it may still be running it.
    const bool runs_it_no_more = written && call_->answer->instance == instance;
    runs_it_no_more ? out.add_answered(instance, call_->id, now)
                    : out.withdraw(instance, call_->id);
  }
  out.end(call_->id, written);
  ++(written || may_be_written ? out.counters().answered : out.counters().withdrawn);
  if (out.wanted(Level::debug)) {
    log_end(written, detail, out, now);
  }
  return {call_, written};
}

void OpenCall::log_end(bool written, const fabric::Message& detail, ChannelOutput& out,
                       Moment now) const {
  const std::string took =
      age_.known ? after(std::chrono::nanoseconds(now.steady - *age_.since)) : std::string();
  const std::string uuid = printable(call_->request.uuid);
  out.log(Level::debug, written
                            ? fmt::format("{} of {} answered with state {}{}", name(), uuid,
                                          call_->answer->state, took)
                            : fmt::format("{} of {} is over{}: {}", name(), uuid, took, detail));
}

Attempt OpenCall::newest_attempt() const {
  return call_->attempts.empty() ? Attempt{{}, 0} : call_->attempts.back();
}

void OpenCall::publish_event(fabric::EventKind kind, const Attempt& of,
                             const fabric::Message& detail, ChannelOutput& out, Moment now,
                             std::string_view answer, std::uint32_t state) const {
  if (!out.events_wanted()) {
    return;
  }
  fabric::Event event;
  event.kind = kind;
  event.detail = detail;
  event.call = call_->id;
  event.uuid = call_->request.uuid;
  event.attempt = of.number;
  event.instance = of.instance;
  event.text = answer;
  event.state = state;
  out.publish(std::move(event), now);
}

}  // namespace millrace::gateway::channel
