#include "gateway/queues/queue_reader.hpp"

#include <algorithm>
#include <ranges>
#include <utility>

#include <fmt/format.h>

#include "base/messages/catalogue.hpp"

namespace millrace::gateway::queues {

void QueueReader::on_up(Moment now) {
  phase_ = Phase::waiting;
  due_ = now.steady;
  compare_ = true;
  fresh_ = false;
  notified_ = false;
  tried_.reset();
}

void QueueReader::on_down() {
  // Entries given to the journal stay there; nothing waits for them.
  phase_ = Phase::down;
  fresh_ = false;
}

void QueueReader::on_event(Moment now) {
  if (phase_ == Phase::waiting) {
    due_ = std::min(due_, now.steady);
  } else {
    // A pending request may be answered with values from before the change.
    notified_ = phase_ != Phase::down;
  }
}

void QueueReader::on_journalled(Moment now) {
  if (phase_ == Phase::journalling) {
    wait({}, now);
  }
}

void QueueReader::read_again(Moment now) {
  fresh_ = false;
  on_event(now);
}

void QueueReader::wait(std::chrono::nanoseconds time, Moment now) {
  phase_ = Phase::waiting;
  due_ = now.steady + time;
  fresh_ = false;
}

std::optional<SteadyTime> QueueReader::next_time() const {
  switch (phase_) {
    case Phase::waiting:
      return due_;
    case Phase::wants_array:
    case Phase::wants_check:
      return SteadyTime{};
    default:
      return std::nullopt;
  }
}

std::optional<Step> QueueReader::next(const QueueLog& queue_log, std::uint64_t writable,
                                      Moment now) {
  if (phase_ == Phase::wants_check) {
    phase_ = Phase::checking;
    return ReadControl{};
  }
  const bool has_read = fresh_ && (phase_ == Phase::waiting || phase_ == Phase::wants_array);
  if (has_read && !compare_) {
    const auto uncovered = queue_log.uncovered() | std::views::reverse;
    const auto last = std::ranges::find_if(
        uncovered, [&](const QueueMessage& message) { return message.number <= writable; });
    if (last != uncovered.end()) {
      phase_ = Phase::writing;
      fresh_ = false;
      tried_ = last->element;
      return WriteLastGet{last->element};
    }
  }
  if (phase_ == Phase::wants_array) {
    phase_ = Phase::reading;
    return ReadQueue{};
  }
  if (phase_ == Phase::waiting && due_ <= now.steady) {
    phase_ = Phase::reading_control;
    return ReadControl{};
  }
  return std::nullopt;
}

QueueReader::ReadResult QueueReader::fail(fabric::Message why, Moment now) {
  wait(retry, now);
  ReadResult result;
  result.wrong = std::move(why);
  return result;
}

QueueReader::ReadResult QueueReader::on_control(const Answer<Control>& answer,
                                                const QueueLog& queue_log, std::size_t room,
                                                Moment now) {
  if (phase_ != Phase::reading_control && phase_ != Phase::checking) {
    return {};
  }
  if (!answer) {
    return fail(answer.error(), now);
  }
  if (auto wrong = wrong_with(*answer); !wrong.empty()) {
    return fail(std::move(wrong), now);
  }
  control_ = *answer;
  return phase_ == Phase::checking ? check(*answer, queue_log, room, now)
                                   : inspect(*answer, queue_log, room, now);
}

QueueReader::ReadResult QueueReader::inspect(const Control& control, const QueueLog& queue_log,
                                             std::size_t room, Moment now) {
  ReadResult result;
  result.fine = true;
  const auto get = static_cast<std::uint32_t>(control.last_get);
  const auto uncovered = queue_log.uncovered();
  const auto& known = queue_log.last_get();
  const auto covered = std::ranges::find(uncovered, get, &QueueMessage::element);
  if (!known) {
    result.covers = ReadResult::Covers{get, queue_log.last_number()};
  } else if (get != *known && covered != uncovered.end()) {
    // Written by this gateway, in this run or in the one before. If not, another reader has taken a
    // message that is journalled, or an NC program has initialised the queue and the element number
    // is the same by chance: comparing the array decides.
    compare_ = compare_ || tried_ != get;
    result.covers = ReadResult::Covers{get, covered->number};
  } else if (get != *known) {
    result.resynchronised = fmt::format(
        "LastGet is {}, not {} as this gateway wrote it: an NC program has initialised the queue "
        "(SSDQInit), or another reader uses it; continuing after {}",
        get, *known, get);
    result.covers = ReadResult::Covers{get, queue_log.last_number()};
  } else if (!uncovered.empty() && !holds(control, uncovered.back().element)) {
    result.resynchronised = fmt::format(
        "LastFilled is {}, but element {} was read already: an NC program has initialised the "
        "queue (SSDQInit); continuing after LastGet, {}",
        control.last_filled, uncovered.back().element, get);
    result.covers = ReadResult::Covers{get, queue_log.last_number()};
  }
  const bool in_vain = tried_ && *tried_ != get && !result.covers;
  const std::uint32_t tried = tried_.value_or(0);
  tried_.reset();
  if (in_vain) {
    return fail(base::messages::last_get_differs(get, tried), now);
  }
  if (result.covers) {
    // The same read again, with what is known now.
    wait({}, now);
    compare_ = compare_ && result.covers->number < queue_log.last_number();
    return result;
  }
  compare_ = compare_ && !uncovered.empty();
  fresh_ = true;
  before_ = control;
  room_ = room;
  const bool more = room > 0 && !elements_after(control, queue_log.read_up_to()).empty();
  if (more || compare_) {
    phase_ = Phase::wants_array;
  } else {
    phase_ = Phase::waiting;
    due_ = now.steady + (std::exchange(notified_, false) ? std::chrono::milliseconds(0) : period_);
  }
  return result;
}

QueueReader::ReadResult QueueReader::on_array(Answer<std::vector<std::string>> answer,
                                              const QueueLog& /*queue_log*/, Moment now) {
  if (phase_ != Phase::reading) {
    return {};
  }
  fresh_ = false;
  if (!answer) {
    return fail(std::move(answer.error()), now);
  }
  if (answer->size() != before_.elements) {
    return fail(base::messages::queue_elements_changed(before_.elements, answer->size()), now);
  }
  texts_ = std::move(*answer);
  phase_ = Phase::wants_check;
  return {};
}

/// Why the array does not hold what was read of it; empty if it does.
std::string QueueReader::compare(const QueueLog& queue_log) const {
  for (const QueueMessage& message : queue_log.uncovered()) {
    if (message.element > texts_.size() || texts_[message.element - 1] != message.text) {
      return fmt::format(
          "element {} does not hold the message that was read from it: an NC program has "
          "initialised the queue (SSDQInit), or another reader uses it; continuing after LastGet",
          message.element);
    }
  }
  return {};
}

QueueReader::ReadResult QueueReader::check(const Control& control, const QueueLog& queue_log,
                                           std::size_t room, Moment now) {
  // The queue was not initialised, and has no other reader: then the messages named before are
  // unchanged.
  const bool same = control.last_get == before_.last_get && control.elements == before_.elements &&
                    filled(control) >= filled(before_);
  if (!same) {
    phase_ = Phase::reading_control;
    return inspect(control, queue_log, room, now);
  }
  ReadResult result;
  result.fine = true;
  if (std::exchange(compare_, false)) {
    if (result.resynchronised = compare(queue_log); !result.resynchronised.empty()) {
      result.covers =
          ReadResult::Covers{static_cast<std::uint32_t>(control.last_get), queue_log.last_number()};
      wait({}, now);
      return result;
    }
  }
  for (const std::uint32_t element : elements_after(before_, queue_log.read_up_to())) {
    if (result.messages.size() == std::min(room, room_)) {
      break;
    }
    result.messages.push_back({element, std::move(texts_[element - 1])});
  }
  if (result.messages.empty()) {
    wait({}, now);
  } else {
    phase_ = Phase::journalling;
  }
  return result;
}

QueueReader::ReadResult QueueReader::on_written(const Answer<void>& answer, Moment now) {
  if (phase_ != Phase::writing) {
    return {};
  }
  if (!answer) {
    tried_.reset();
    return fail(answer.error(), now);
  }
  if (control_ && tried_) {
    // Known also if the controller is gone before the next read.
    control_->last_get = *tried_;
  }
  wait({}, now);
  return {};
}

}  // namespace millrace::gateway::queues
