#include "gateway/channel/released.hpp"

#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::channel {

Released::Released(PendingRequest request, const AnswerWriter& writer)
    : request_(std::move(request)),
      text_(writer.text()),
      state_(writer.state()),
      stood_(writer.state_before()),
      text_last_(writer.text_last()),
      zero_seen_(writer.zero_seen()),
      cleared_(writer.may_be_cleared()),
      state_seen_(writer.state_seen() && state_ != 0),
      sent_(writer.released()),
      whole_(text_last_) {}

Released::Found Released::on_read(const ServiceSnapshot& snapshot, const ReadTime& time) {
  if (!text_last_ && snapshot.response_state == state_) {
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
  if (!text_last_ && snapshot.response_state != 0 &&
      (snapshot.response_state == state_ || snapshot.response_state != stood_)) {
    return Found::idle;
  }
  if (!text_last_ && snapshot.response_state == 0 && stood_ != 0 && !cleared_) {
    return Found::idle;  // the interim state was set to 0, and not by us
  }
  if (!snapshot.has(Variable::response)) {
    whole_ = true;
    return Found::nothing;
  }
  const bool same_texts = snapshot.uuid == request_.uuid && snapshot.request == request_.text;
  const bool shows_text = snapshot.response == text_;
  if (!same_texts || shows_text == text_last_) {
    return Found::idle;
  }
  return release_again(time);
}

/// No read has shown REQUEST_STATE 0 yet.
Released::Found Released::decide_uncleared(const ServiceSnapshot& snapshot, const ReadTime& time) {
  if (snapshot.request_state == 0) {
    zero_seen_ = true;
    return cleared_ ? decide(snapshot, time) : Found::idle;
  }
  if (snapshot.request_state != request_.state) {
    return Found::request;
  }
  if (!text_last_ && snapshot.response_state == state_) {
    release_seen_ = true;
  }
  if (!text_last_ && snapshot.response_state != 0 && state_seen_) {
    return Found::nothing;
  }
  if (snapshot.response_state == 0 && state_seen_) {
    return Found::request;
  }
  if (!snapshot.has(Variable::response)) {
    whole_ = true;
    return Found::nothing;
  }
  const bool same_texts = snapshot.uuid == request_.uuid && snapshot.request == request_.text;
  const bool shows_text = snapshot.response == text_;
  if (text_last_ && shows_text) {
    release_seen_ = true;
  }
  // RESPONSE was visible before the release, or has been since: so the NC program that changed it
  // has continued.
  const bool text_gone = (!text_last_ || release_seen_) && !shows_text;
  if (same_texts && !text_gone) {
    moved_on_.reset();
    return text_last_ && shows_text ? Found::nothing : release_again(time);
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

void Released::on_link_up() {
  read_at_ = SteadyTime{};
}

}  // namespace millrace::gateway::channel
