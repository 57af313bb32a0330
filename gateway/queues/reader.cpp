#include "gateway/queues/reader.hpp"

#include <algorithm>
#include <ranges>
#include <utility>

#include <fmt/format.h>

namespace millrace::gateway::queues {

void Reader::on_up(Moment now) {
  phase_ = Phase::waiting;
  due_ = now.steady;
  compare_ = true;
  fresh_ = false;
  told_ = false;
  tried_.reset();
}

void Reader::on_down() {
  // What the journal has been given it keeps; nothing waits for it.
  phase_ = Phase::down;
  fresh_ = false;
}

void Reader::on_event(Moment now) {
  if (phase_ == Phase::waiting) {
    due_ = std::min(due_, now.steady);
  } else {
    // What is asked now may have been answered before it happened.
    told_ = phase_ != Phase::down;
  }
}

void Reader::on_journalled(Moment now) {
  if (phase_ == Phase::journalling) {
    wait({}, now);
  }
}

void Reader::look_again(Moment now) {
  fresh_ = false;
  on_event(now);
}

void Reader::wait(std::chrono::nanoseconds time, Moment now) {
  phase_ = Phase::waiting;
  due_ = now.steady + time;
  fresh_ = false;
}

std::optional<SteadyTime> Reader::next_time() const {
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

std::optional<Step> Reader::next(const QueueBook& book, std::uint64_t writable, Moment now) {
  if (phase_ == Phase::wants_check) {
    phase_ = Phase::checking;
    return ReadControl{};
  }
  const bool looked = fresh_ && (phase_ == Phase::waiting || phase_ == Phase::wants_array);
  if (looked && !compare_) {
    const auto uncovered = book.uncovered() | std::views::reverse;
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
    phase_ = Phase::looking;
    return ReadControl{};
  }
  return std::nullopt;
}

Reader::Findings Reader::fail(std::string why, Moment now) {
  wait(retry, now);
  Findings findings;
  findings.wrong = std::move(why);
  return findings;
}

Reader::Findings Reader::on_control(const tl::expected<Control, std::string>& answer,
                                    const QueueBook& book, std::size_t room, Moment now) {
  if (phase_ != Phase::looking && phase_ != Phase::checking) {
    return {};
  }
  if (!answer) {
    return fail(answer.error(), now);
  }
  if (auto wrong = wrong_with(*answer); !wrong.empty()) {
    return fail(std::move(wrong), now);
  }
  control_ = *answer;
  return phase_ == Phase::checking ? check(*answer, book, room, now)
                                   : look(*answer, book, room, now);
}

Reader::Findings Reader::look(const Control& control, const QueueBook& book, std::size_t room,
                              Moment now) {
  Findings findings;
  findings.fine = true;
  const auto get = static_cast<std::uint32_t>(control.last_get);
  const auto uncovered = book.uncovered();
  const auto& known = book.last_get();
  const auto ours = std::ranges::find(uncovered, get, &QueueMessage::element);
  if (!known) {
    findings.covers = Findings::Covers{get, book.last_number()};
  } else if (get != *known && ours != uncovered.end()) {
    // Written by us, in this run or in the one before. If not, somebody else has read a message
    // that is journalled, or a program has initialised the queue and an element's number is the
    // same: what the array holds tells.
    compare_ = compare_ || tried_ != get;
    findings.covers = Findings::Covers{get, ours->number};
  } else if (get != *known) {
    findings.adopted = fmt::format(
        "LastGet is {}, not {} as this gateway has left it: a program has initialised the queue "
        "(SSDQInit), or somebody else reads it too; going on behind {}",
        get, *known, get);
    findings.covers = Findings::Covers{get, book.last_number()};
  } else if (!uncovered.empty() && !holds(control, uncovered.back().element)) {
    findings.adopted = fmt::format(
        "LastFilled is {}, but element {} was read already: a program has initialised the queue "
        "(SSDQInit); going on behind LastGet, {}",
        control.last_filled, uncovered.back().element, get);
    findings.covers = Findings::Covers{get, book.last_number()};
  }
  const bool in_vain = tried_ && *tried_ != get && !findings.covers;
  const std::uint32_t tried = tried_.value_or(0);
  tried_.reset();
  if (in_vain) {
    return fail(fmt::format("has LastGet {}, although {} was written there", get, tried), now);
  }
  if (findings.covers) {
    // The same look again, with what is known now.
    wait({}, now);
    compare_ = compare_ && findings.covers->number < book.last_number();
    return findings;
  }
  compare_ = compare_ && !uncovered.empty();
  fresh_ = true;
  before_ = control;
  room_ = room;
  const bool more = room > 0 && !elements_behind(control, book.read_up_to()).empty();
  if (more || compare_) {
    phase_ = Phase::wants_array;
  } else {
    phase_ = Phase::waiting;
    due_ = now.steady + (std::exchange(told_, false) ? std::chrono::milliseconds(0) : period_);
  }
  return findings;
}

Reader::Findings Reader::on_array(tl::expected<std::vector<std::string>, std::string> answer,
                                  const QueueBook& /*book*/, Moment now) {
  if (phase_ != Phase::reading) {
    return {};
  }
  fresh_ = false;
  if (!answer) {
    return fail(std::move(answer.error()), now);
  }
  if (answer->size() != before_.elements) {
    return fail(
        fmt::format("has {} elements, and was read with {}", before_.elements, answer->size()),
        now);
  }
  texts_ = std::move(*answer);
  phase_ = Phase::wants_check;
  return {};
}

/// Why the array does not hold what was read of it; empty if it does.
std::string Reader::compare(const QueueBook& book) const {
  for (const QueueMessage& message : book.uncovered()) {
    if (message.element > texts_.size() || texts_[message.element - 1] != message.text) {
      return fmt::format(
          "element {} does not hold the message that was read of it: a program has initialised the "
          "queue (SSDQInit), or somebody else reads it too; going on behind LastGet",
          message.element);
    }
  }
  return {};
}

Reader::Findings Reader::check(const Control& control, const QueueBook& book, std::size_t room,
                               Moment now) {
  // Nobody has initialised the queue, and no other reader was there: then what was named before
  // still is.
  const bool same = control.last_get == before_.last_get && control.elements == before_.elements &&
                    filled(control) >= filled(before_);
  if (!same) {
    phase_ = Phase::looking;
    return look(control, book, room, now);
  }
  Findings findings;
  findings.fine = true;
  if (std::exchange(compare_, false)) {
    if (findings.adopted = compare(book); !findings.adopted.empty()) {
      findings.covers =
          Findings::Covers{static_cast<std::uint32_t>(control.last_get), book.last_number()};
      wait({}, now);
      return findings;
    }
  }
  for (const std::uint32_t element : elements_behind(before_, book.read_up_to())) {
    if (findings.messages.size() == std::min(room, room_)) {
      break;
    }
    findings.messages.push_back({element, std::move(texts_[element - 1])});
  }
  if (findings.messages.empty()) {
    wait({}, now);
  } else {
    phase_ = Phase::journalling;
  }
  return findings;
}

Reader::Findings Reader::on_written(const tl::expected<void, std::string>& answer, Moment now) {
  if (phase_ != Phase::writing) {
    return {};
  }
  if (!answer) {
    tried_.reset();
    return fail(answer.error(), now);
  }
  if (control_ && tried_) {
    // Known also if the controller is gone before the next look.
    control_->last_get = *tried_;
  }
  wait({}, now);
  return {};
}

}  // namespace millrace::gateway::queues
