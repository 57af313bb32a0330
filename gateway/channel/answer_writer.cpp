#include "gateway/channel/answer_writer.hpp"

#include <algorithm>
#include <cassert>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::channel {

namespace {

constexpr std::chrono::milliseconds soon{2};
constexpr std::chrono::milliseconds soon_for{50};
constexpr std::chrono::milliseconds later{10};

bool same_texts(const ServiceSnapshot& snapshot, const PendingRequest& request) {
  return snapshot.uuid == request.uuid && snapshot.request == request.text;
}

}  // namespace

bool Sent::due_again(const ReadTime& read) const {
  const unsigned doublings = std::min(times - 1, 6U);
  return read.fresh() &&
         read.asked - last >= std::min(takes_effect * (1U << doublings), longest_repeat);
}

std::optional<std::chrono::nanoseconds> Sent::note_read(bool shows, const ReadTime& read) {
  if (times == 0 || shown || read.asked < last) {
    return {};
  }
  if (!shows) {
    late = true;
    return {};
  }
  shown = true;
  // After a repeated write it is unknown which of the writes is shown.
  return times > 1 ? std::nullopt
                   : std::optional(late ? read.came - last : std::chrono::nanoseconds{});
}

SteadyTime Sent::next_read(SteadyTime now) const {
  return now + (now - last < soon_for ? soon : later);
}

AnswerWriter AnswerWriter::resumed(Response response, bool clearing,
                                   fabric::CompletionSignal completion_signal, bool state_stood) {
  AnswerWriter writer(Kind::final, std::move(response), completion_signal, state_stood);
  writer.resumed_ = true;
  writer.clearing_recorded_ = clearing;
  writer.all_may_be_written_ = clearing;
  return writer;
}

AnswerWriter::Step AnswerWriter::on_read(const ServiceSnapshot& snapshot, RequestStatus status,
                                         const PendingRequest& request, const ReadTime& time) {
  assert(next_ == Step::read && snapshot.set == reads());
  if (std::exchange(all_may_be_written_, false)) {
    // By the earlier run, and just now.
    response_sent_.note(time.came);
    state_sent_.note(time.came);
    if (clearing_is_.is_written) {
      clear_sent_.note(time.came);
    }
  }
  at_once_ = false;
  response_stands_ = snapshot.has(Variable::response) && snapshot.response == text();
  request_state_zero_ = snapshot.request_state == 0;
  state_stands_ = snapshot.response_state == state();
  state_before_ = snapshot.response_state;
  if (kind_ == Kind::final) {
    note_shown(response_sent_, snapshot.has(Variable::response) && response_stands_, time);
    note_shown(clear_sent_, request_state_zero_, time);
  }
  if (state_sent_.times == 0) {
    state_stood_ = state_stood_ || (state_stands_ && state() != 0);
  } else {
    state_seen_ = state_seen_ || (state_stands_ && !state_stood_);
  }
  if (status == RequestStatus::replaced) {
    zero_seen_ = zero_seen_ || zero_read_;
    next_ = over();
    return next_;
  }
  zero_read_ = zero_read_ || request_state_zero_;
  next_ = kind_ == Kind::interim ? decide_interim(snapshot, status, request, time)
                                 : decide_final(snapshot, status, request, time);
  if (next_ == Step::read && !at_once_) {
    wait(time.came);
  }
  unreleased_ = next_ == Step::read && at_once_;
  return next_;
}

void AnswerWriter::note_shown(Sent& sent, bool shows, const ReadTime& time) {
  if (const auto after = sent.note_read(shows, time)) {
    shown_after_ = std::max(shown_after_.value_or(std::chrono::nanoseconds{}), *after);
  }
}

AnswerWriter::Step AnswerWriter::decide_interim(const ServiceSnapshot& snapshot,
                                                RequestStatus status, const PendingRequest& request,
                                                const ReadTime& time) {
  if (status != RequestStatus::pending) {
    // A kernel that clears REQUEST_STATE may show that before it shows the state that we have
    // written.
    const bool may_show_it_yet = status == RequestStatus::withdrawn && state_sent_.times > 0 &&
                                 same_texts(snapshot, request) &&
                                 time.asked - state_sent_.last < takes_effect;
    return may_show_it_yet ? Step::read : Step::dropped;
  }
  if (state_sent_.times > 0 && state_stands_) {
    return Step::done;
  }
  if (!response_stands_) {
    return bring(response_sent_, Step::write_response, "RESPONSE", time);
  }
  return bring(state_sent_, Step::write_state, "RESPONSE_STATE", time);
}

AnswerWriter::Step AnswerWriter::decide_final(const ServiceSnapshot& snapshot, RequestStatus status,
                                              const PendingRequest& request, const ReadTime& time) {
  if (may_be_released()) {
    const bool shown = text_last_ ? response_stands_ && state_stands_ : state_stands_;
    if (shown && (request_state_zero_ || !state_stood_)) {
      zero_seen_ = zero_seen_ || request_state_zero_;
      return Step::done;
    }
  }
  const bool by_us = text_last_ && state_sent_.times > 0 && state_stands_;
  if (status == RequestStatus::answered && !by_us) {
    return Step::dropped;
  }
  if (status == RequestStatus::pending && !request_state_zero_) {
    return decide_uncleared(time);
  }
  if (status != RequestStatus::pending) {
    if (clear_sent_.times == 0 && state_sent_.times == 0) {
      return Step::dropped;  // the program has taken its request back
    }
    if (!same_texts(snapshot, request)) {
      return over();
    }
    if (clear_sent_.times == 0 && !text_last_) {
      // This 0 is not ours. Either the kernel wrote it, which may show it before the state that it
      // follows, or the NC program has withdrawn its request.
      return state_sent_.due_again(time) ? over() : Step::read;
    }
    if (!text_last_ && !response_stands_ && !written_here_) {
      // An earlier run wrote RESPONSE. If that write is not late, another writer has changed it
      // since.
      return response_sent_.due_again(time) ? Step::dropped : Step::read;
    }
    if (!text_last_ && !response_stands_ && may_be_released()) {
      return Step::done;  // a read had shown it before the release
    }
  }
  zero_seen_ = true;
  return complete(time);
}

AnswerWriter::Step AnswerWriter::decide_uncleared(const ReadTime& time) {
  if (!text_last_ && response_sent_.times == 0 && !response_stands_) {
    return Step::write_response;
  }
  if (!clearing_recorded_) {
    // A gateway that finds the call in the journal relies on RESPONSE.
    return response_unknown_ && !response_stands_
               ? bring(response_sent_, Step::write_response, "RESPONSE", time)
               : Step::record_clearing;
  }
  if (clearing_is_.is_written && clear_sent_.times == 0) {
    return Step::clear;
  }
  if (!text_last_ && !response_stands_) {
    return bring(response_sent_, Step::write_response, "RESPONSE", time);
  }
  if (clearing_is_.is_shown && clear_sent_.due_again(time)) {
    if (clear_sent_.times < (clearing_is_.was_shown ? 5U : 2U)) {
      return bring(clear_sent_, Step::clear, "REQUEST_STATE = 0", time);
    }
    clearing_is_.is_shown = false;
    report_ =
        "this controller shows REQUEST_STATE = 0 only after RESPONSE_STATE is written, if at all; "
        "if its kernel clears REQUEST_STATE itself, set kernel_clears_request_state for this "
        "machine, and its first response is released earlier";
    problem_.clear();
  }
  return clearing_is_.is_shown ? Step::read : complete(time);
}

AnswerWriter::Step AnswerWriter::complete(const ReadTime& time) {
  if (!text_last_) {
    return response_stands_ ? release(time)
                            : bring(response_sent_, Step::write_response, "RESPONSE", time);
  }
  return state_stands_ ? release(time)
                       : bring(state_sent_, Step::write_state, "RESPONSE_STATE", time);
}

AnswerWriter::Step AnswerWriter::release(const ReadTime& time) {
  const Step step = text_last_ ? Step::write_response : Step::write_state;
  if (!may_be_released()) {
    if (request_state_zero_ && response_stands_ && state_stands_ && (text_last_ || state() != 0)) {
      // Another gateway has written the same answer, and released the program.
      (text_last_ ? response_sent_ : state_sent_).note(time.came);
      return Step::done;
    }
    return step;
  }
  if (!released().due_again(time)) {
    return Step::read;
  }
  if (!unreleased_) {
    // A program that was released and asks again clears RESPONSE_STATE, or empties RESPONSE,
    // between two reads of one snapshot. A second one finds its new REQUEST_STATE, or its new
    // texts.
    at_once_ = true;
    read_at_ = {};
    return Step::read;
  }
  return bring(released(), step, text_last_ ? "RESPONSE" : "RESPONSE_STATE", time);
}

AnswerWriter::Step AnswerWriter::bring(const Sent& sent, Step write, std::string_view what,
                                       const ReadTime& time) {
  if (sent.times == 0) {
    return write;
  }
  if (!sent.due_again(time)) {
    return Step::read;
  }
  repeat(sent, what);
  return write;
}

void AnswerWriter::repeat(const Sent& sent, std::string_view what) {
  problem_ = base::messages::write_not_shown(what, sent.times + 1);
  report_ = problem_.text;
}

AnswerWriter::Step AnswerWriter::clear() const {
  if (request_state_zero_) {
    return Step::read;
  }
  if (!clearing_recorded_) {
    return Step::record_clearing;
  }
  return clearing_is_.is_written && clear_sent_.times == 0 ? Step::clear : Step::read;
}

void AnswerWriter::wait(SteadyTime now) {
  const SteadyTime last = std::max({response_sent_.last, clear_sent_.last, state_sent_.last});
  read_at_ = Sent{1, last}.next_read(now);
}

AnswerWriter::Step AnswerWriter::on_written(SteadyTime now) {
  // The write is verified by a read at once.
  read_at_ = {};
  switch (next_) {
    case Step::write_response:
      response_sent_.note(now);
      written_here_ = true;
      response_unknown_ = false;
      if (text_last_) {
        next_ = Step::done;
      } else {
        next_ = kind_ == Kind::interim ? Step::read : clear();
      }
      break;
    case Step::clear:
      clear_sent_.note(now);
      next_ = Step::read;
      break;
    case Step::write_state:
      state_sent_.note(now);
      next_ = text_last_ ? Step::read : Step::done;
      break;
    default:
      assert(false && "no write was requested");
  }
  return next_;
}

AnswerWriter::Step AnswerWriter::on_unknown(SteadyTime now) {
  switch (next_) {
    case Step::write_response:
      response_sent_.note(now);
      written_here_ = true;
      response_unknown_ = true;
      break;
    case Step::clear:
      clear_sent_.note(now);
      break;
    case Step::write_state:
      state_sent_.note(now);
      break;
    default:
      assert(false && "no write was requested");
  }
  read_at_ = {};
  next_ = Step::read;
  return next_;
}

AnswerWriter::Step AnswerWriter::on_recorded(bool fresh) {
  assert(next_ == Step::record_clearing);
  clearing_recorded_ = true;
  read_at_ = {};
  next_ = fresh && clearing_is_.is_written ? Step::clear : Step::read;
  return next_;
}

AnswerWriter::Step AnswerWriter::read_again() {
  if (next_ != Step::done && next_ != Step::dropped) {
    read_at_ = {};
    next_ = Step::read;
  }
  return next_;
}

void AnswerWriter::on_link_up() {
  read_again();
  // An acknowledged write may still take effect later, and the final response must not follow an
  // interim one before that.
  if (kind_ == Kind::final && clear_sent_.times == 0 && state_sent_.times == 0) {
    response_sent_ = {};
  }
}

}  // namespace millrace::gateway::channel
