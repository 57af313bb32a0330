#include "gateway/channel/answer_writer.hpp"

#include <algorithm>
#include <cassert>

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

std::optional<std::chrono::nanoseconds> Sent::note_read(const ReadTime& read) {
  if (times == 0 || shown || read.asked < last) {
    return {};
  }
  if (!stands) {
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
  writer.earlier_run_ = {.begun = true, .all = clearing};
  writer.clearing_recorded_ = clearing;
  return writer;
}

AnswerWriter::Step AnswerWriter::on_read(const ServiceSnapshot& snapshot, RequestStatus status,
                                         const PendingRequest& request, const ReadTime& time) {
  assert(next_ == Step::read && snapshot.set == reads());
  if (!may_be_released()) {
    read_.state = snapshot.response_state;
  }
  if (std::exchange(earlier_run_.all, false)) {
    // By the earlier run, and just now.
    sent_.text.note(time.came);
    sent_.state.note(time.came);
    if (clearing_is_.is_written) {
      sent_.zero.note(time.came);
    }
  }
  sent_.text.stands = snapshot.has(Variable::response) && snapshot.response == text();
  sent_.zero.stands = snapshot.request_state == 0;
  sent_.state.stands = snapshot.response_state == state();
  if (kind_ == Kind::final) {
    note_shown(sent_.text, time);
    note_shown(sent_.zero, time);
  }
  if (sent_.state.times == 0) {
    read_.state_stood = read_.state_stood || (sent_.state.stands && state() != 0);
  } else {
    read_.state_seen = read_.state_seen || (sent_.state.stands && !read_.state_stood);
  }
  if (status == RequestStatus::replaced) {
    read_.zero_before_release = read_.zero_before_release || read_.zero;
    next_ = over();
    return next_;
  }
  read_.zero = read_.zero || sent_.zero.stands;
  const unsigned unreleased = read_.unreleased;
  next_ = kind_ == Kind::interim ? decide_interim(snapshot, status, request, time)
                                 : decide_final(snapshot, status, request, time);
  if (next_ != Step::read || read_.unreleased == unreleased) {
    read_.unreleased = 0;
    if (next_ == Step::read) {
      wait(time.came);
    }
  }
  return next_;
}

void AnswerWriter::note_shown(Sent& sent, const ReadTime& time) {
  if (const auto after = sent.note_read(time)) {
    report_.shown_after =
        std::max(report_.shown_after.value_or(std::chrono::nanoseconds{}), *after);
  }
}

AnswerWriter::Step AnswerWriter::decide_interim(const ServiceSnapshot& snapshot,
                                                RequestStatus status, const PendingRequest& request,
                                                const ReadTime& time) {
  if (status != RequestStatus::pending) {
    // CLEARS: the 0 may be shown before the state that we have written.
    const bool may_show_it_yet = status == RequestStatus::withdrawn && sent_.state.times > 0 &&
                                 same_texts(snapshot, request) &&
                                 time.asked - sent_.state.last < takes_effect;
    return may_show_it_yet ? Step::read : Step::dropped;
  }
  if (sent_.state.times > 0 && sent_.state.stands) {
    return Step::done;
  }
  if (!sent_.text.stands) {
    return bring(sent_.text, Step::write_response, "RESPONSE", time);
  }
  return bring(sent_.state, Step::write_state, "RESPONSE_STATE", time);
}

AnswerWriter::Step AnswerWriter::decide_final(const ServiceSnapshot& snapshot, RequestStatus status,
                                              const PendingRequest& request, const ReadTime& time) {
  if (may_be_released()) {
    const bool shown = text_last_ ? sent_.text.stands && sent_.state.stands : sent_.state.stands;
    if (shown && (sent_.zero.stands || !read_.state_stood)) {
      read_.zero_before_release = read_.zero_before_release || sent_.zero.stands;
      return Step::done;
    }
  }
  const bool by_us = text_last_ && sent_.state.times > 0 && sent_.state.stands;
  if (status == RequestStatus::answered && !by_us) {
    return Step::dropped;
  }
  if (status == RequestStatus::pending && !sent_.zero.stands) {
    return decide_uncleared(time);
  }
  if (status != RequestStatus::pending) {
    if (sent_.zero.times == 0 && sent_.state.times == 0) {
      return Step::dropped;  // the program has taken its request back
    }
    // After a 0 of any writer another value is the next request.
    read_.zero_before_release = read_.zero_before_release || may_be_cleared();
    if (!same_texts(snapshot, request)) {
      return over();
    }
    if (sent_.zero.times == 0 && !text_last_) {
      // CLEARS: this 0 is not ours. Either the kernel wrote it, which may show it before the state
      // that it follows, or the NC program has withdrawn its request.
      return sent_.state.due_again(time) ? over() : Step::read;
    }
    if (!text_last_ && !sent_.text.stands && !earlier_run_.text_rewritten) {
      // LATE: an earlier run wrote RESPONSE. If that write is not late, another writer has changed
      // it since.
      return sent_.text.due_again(time) ? Step::dropped : Step::read;
    }
    if (!text_last_ && !sent_.text.stands && may_be_released()) {
      return Step::done;  // a read had shown it before the release
    }
  }
  read_.zero_before_release = true;
  return complete(time);
}

AnswerWriter::Step AnswerWriter::decide_uncleared(const ReadTime& time) {
  if (!text_last_ && sent_.text.times == 0 && !sent_.text.stands) {
    return Step::write_response;
  }
  if (!clearing_recorded_) {
    // A gateway that finds the call in the journal relies on RESPONSE.
    return sent_.text.unknown && !sent_.text.stands
               ? bring(sent_.text, Step::write_response, "RESPONSE", time)
               : Step::record_clearing;
  }
  if (clearing_is_.is_written && sent_.zero.times == 0) {
    return Step::clear;
  }
  if (!text_last_ && !sent_.text.stands) {
    return bring(sent_.text, Step::write_response, "RESPONSE", time);
  }
  if (!does_without_clearing_ && clearing_is_.most > 0) {
    if (!sent_.zero.due_again(time)) {
      return Step::read;
    }
    if (sent_.zero.times < clearing_is_.most) {
      return bring(sent_.zero, Step::clear, "REQUEST_STATE = 0", time);
    }
    does_without_clearing_ = true;
    report_.problem.clear();
    if (sent_.zero.times > 1) {
      report_.line =
          "this controller shows REQUEST_STATE = 0 only after RESPONSE_STATE is written, if at "
          "all; if its kernel clears REQUEST_STATE itself, set kernel_clears_request_state for "
          "this machine, and its first responses are released earlier";
    }
  }
  return complete(time);
}

AnswerWriter::Step AnswerWriter::complete(const ReadTime& time) {
  if (!text_last_) {
    return sent_.text.stands ? release(time)
                             : bring(sent_.text, Step::write_response, "RESPONSE", time);
  }
  return sent_.state.stands ? release(time)
                            : bring(sent_.state, Step::write_state, "RESPONSE_STATE", time);
}

AnswerWriter::Step AnswerWriter::release(const ReadTime& time) {
  const Step step = text_last_ ? Step::write_response : Step::write_state;
  if (!may_be_released()) {
    if (sent_.zero.stands && sent_.text.stands && sent_.state.stands &&
        (text_last_ || state() != 0)) {
      // Another gateway has written the same answer, and released the program.
      (text_last_ ? sent_.text : sent_.state).note(time.came);
      return Step::done;
    }
    return step;
  }
  if (!released().due_again(time)) {
    return Step::read;
  }
  if (++read_.unreleased == 1) {
    // RESETS: a program that was released and asks again clears RESPONSE_STATE, or empties
    // RESPONSE, between two reads of one snapshot. A second one finds its new REQUEST_STATE, or its
    // new texts.
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
  report_.problem = base::messages::write_not_shown(what, sent.times + 1);
  report_.line = report_.problem.text;
  return write;
}

AnswerWriter::Step AnswerWriter::clear() const {
  if (sent_.zero.stands) {
    return Step::read;
  }
  if (!clearing_recorded_) {
    return Step::record_clearing;
  }
  return clearing_is_.is_written && sent_.zero.times == 0 ? Step::clear : Step::read;
}

void AnswerWriter::wait(SteadyTime now) {
  const SteadyTime last = std::max({sent_.text.last, sent_.zero.last, sent_.state.last});
  read_at_ = Sent{1, last}.next_read(now);
}

AnswerWriter::Step AnswerWriter::on_written(SteadyTime now) {
  // The write is verified by a read at once.
  read_at_ = {};
  switch (next_) {
    case Step::write_response:
      sent_.text.note(now);
      earlier_run_.text_rewritten = true;
      if (text_last_) {
        next_ = Step::done;
      } else {
        next_ = kind_ == Kind::interim ? Step::read : clear();
      }
      break;
    case Step::clear:
      sent_.zero.note(now);
      next_ = Step::read;
      break;
    case Step::write_state:
      sent_.state.note(now);
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
      sent_.text.note(now, true);
      earlier_run_.text_rewritten = true;
      break;
    case Step::clear:
      sent_.zero.note(now);
      break;
    case Step::write_state:
      sent_.state.note(now);
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
  // LATE: an acknowledged write may still take effect later, and the final response must not follow
  // an interim one before that.
  if (kind_ == Kind::final && !may_be_cleared() && !may_be_released()) {
    sent_.text = {};
  }
}

Released::Found Released::on_read(const ServiceSnapshot& snapshot, const ReadTime& time) {
  if (!answer_.text_last() && snapshot.response_state == answer_.state()) {
    state_seen_ = true;
  }
  const Found found = zero_seen_ ? decide(snapshot, time) : decide_uncleared(snapshot, time);
  if (found == Found::nothing) {
    if (!snapshot.has(Variable::response) && reads() == ReadSet::all) {
      read_at_ = SteadyTime{};
    } else if (release_seen_ || state_seen_) {
      read_at_.reset();
    } else {
      read_at_ = sent_.next_read(time.came);
    }
  }
  return found;
}

Released::Found Released::decide(const ServiceSnapshot& snapshot, const ReadTime& time) {
  if (snapshot.request_state != 0) {
    return Found::request;
  }
  if (!answer_.text_last() && snapshot.response_state != 0 &&
      (snapshot.response_state == answer_.state() ||
       snapshot.response_state != answer_.state_before())) {
    return Found::idle;
  }
  if (!answer_.text_last() && snapshot.response_state == 0 && answer_.state_before() != 0 &&
      !answer_.may_be_cleared()) {
    return Found::idle;  // RESETS: the interim state was set to 0, and not by us
  }
  if (!snapshot.has(Variable::response)) {
    whole_ = true;
    return Found::nothing;
  }
  const bool shows_text = snapshot.response == answer_.text();
  if (!same_texts(snapshot, request_) || shows_text == answer_.text_last()) {
    return Found::idle;
  }
  return release_again(time);
}

Released::Found Released::decide_uncleared(const ServiceSnapshot& snapshot, const ReadTime& time) {
  if (snapshot.request_state == 0) {
    zero_seen_ = true;
    return answer_.may_be_cleared() ? decide(snapshot, time) : Found::idle;
  }
  if (snapshot.request_state != request_.state) {
    return Found::request;
  }
  if (!answer_.text_last() && snapshot.response_state == answer_.state()) {
    release_seen_ = true;
  }
  if (!answer_.text_last() && snapshot.response_state != 0 && state_seen_) {
    return Found::nothing;
  }
  if (snapshot.response_state == 0 && state_seen_) {
    return Found::request;
  }
  if (!snapshot.has(Variable::response)) {
    whole_ = true;
    return Found::nothing;
  }
  const bool shows_text = snapshot.response == answer_.text();
  if (answer_.text_last() && shows_text) {
    release_seen_ = true;
  }
  // RESPONSE was visible before the release, or has been since: so the NC program that changed it
  // has continued.
  const bool text_gone = (!answer_.text_last() || release_seen_) && !shows_text;
  if (same_texts(snapshot, request_) && !text_gone) {
    moved_on_.reset();
    return answer_.text_last() && shows_text ? Found::nothing : release_again(time);
  }
  // Only time shows whether its next request is complete.
  moved_on_ = moved_on_.value_or(time.came);
  return time.asked - *moved_on_ >= takes_effect ? Found::request : Found::nothing;
}

Released::Found Released::release_again(const ReadTime& time) {
  if (!sent_.due_again(time)) {
    return Found::nothing;
  }
  if (sent_.times > 1) {
    problem_ = base::messages::write_not_shown(name_of(variable()), sent_.times + 1);
  }
  return Found::unreleased;
}

void Released::on_written(SteadyTime now) {
  sent_.note(now);
  read_at_ = SteadyTime{};
}

}  // namespace millrace::gateway::channel
