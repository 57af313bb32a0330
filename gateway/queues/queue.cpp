#include "gateway/queues/queue.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <fmt/format.h>

#include "fabric/cases.hpp"
#include "gateway/queues/queue_words.hpp"

namespace millrace::gateway::queues {

namespace {

/// Three quarters; and of few places all but one, so that it is said before the last one is taken.
constexpr bool is_filling(std::size_t used, std::size_t all) {
  return used * 4 >= all * 3 || (used > 0 && used + 1 >= all);
}

}  // namespace

Queue::Queue(const std::string& machine, QueueSettings settings, QueueBook book)
    : settings_(std::move(settings)),
      key_(settings_.key(machine)),
      book_(std::move(book)),
      reader_(settings_.period),
      window_(settings_.uuid) {
  if (book_.last_get() && (book_.waiting() > 0 || !book_.uncovered().empty())) {
    // What a gateway that runs knows of its journal need not be on the disk yet: what is written
    // behind it says when it is.
    settled_ = false;
    note(LastGetEntry{key_, *book_.last_get(), book_.covered()});
    wait_for_journal();
  } else {
    journalled_ = book_.last_number();
  }
  // Its call may be under way; what that has journalled stands behind the message.
  show_next();
}

Queue::News Queue::take_news() {
  return std::exchange(news_, {});
}

void Queue::change(QueueSettings settings) {
  settings_ = std::move(settings);
  reader_.set_period(settings_.period);
  window_.set_uuid(settings_.uuid);
  news_.shows = window_.shown().has_value();
}

void Queue::note(JournalEntry entry) {
  std::visit(
      fabric::Cases{[this](const MessageEntry& one) { book_.apply(one); },
                    [this](const MessageEndedEntry& one) { book_.apply(one); },
                    [this](const LastGetEntry& one) { book_.apply(one); }, [](const auto&) {}},
      entry);
  news_.entries.push_back(std::move(entry));
}

void Queue::show_next() {
  const QueueMessage* const next = book_.next();
  if (!window_.shown() && next != nullptr) {
    window_.show(*next);
    news_.shows = true;
  }
}

void Queue::on_up(Moment now) {
  trouble_.clear();
  reader_.on_up(now);
}

void Queue::on_down(const std::string& reason) {
  trouble_ = reason;
  reader_.on_down();
}

void Queue::on_event(Moment now) {
  reader_.on_event(now);
}

std::uint64_t Queue::writable() const {
  return settings_.drain == Drain::when_answered ? book_.ended() : journalled_;
}

std::size_t Queue::room() const {
  return settings_.backlog - std::min(settings_.backlog, book_.waiting());
}

std::optional<Step> Queue::next(Moment now) {
  return settled_ ? reader_.next(book_, writable(), now) : std::nullopt;
}

void Queue::on_control(const tl::expected<Control, std::string>& answer, Moment now) {
  take(reader_.on_control(answer, book_, room(), now), now);
}

void Queue::on_array(tl::expected<std::vector<std::string>, std::string> answer, Moment now) {
  take(reader_.on_array(std::move(answer), book_, now), now);
}

void Queue::on_written(const tl::expected<void, std::string>& answer, Moment now) {
  take(reader_.on_written(answer, now), now);
}

void Queue::take(Reader::Findings findings, Moment now) {
  if (!findings.wrong.empty() && findings.wrong != trouble_) {
    trouble_ = findings.wrong;
    news_.lines.push_back({Level::warn, fmt::format("{} {}", settings_.array, trouble_)});
    news_.trouble = fmt::format("{}: {} {}", key_.to_string(), settings_.array, trouble_);
  } else if (findings.fine && !trouble_.empty()) {
    trouble_.clear();
    news_.lines.push_back({Level::info, fmt::format("{} is read again", settings_.array)});
    news_.trouble = std::string();
  }
  if (!findings.adopted.empty()) {
    news_.lines.push_back({Level::warn, fmt::format("{}: {}", settings_.array, findings.adopted)});
  }
  if (findings.covers) {
    note(LastGetEntry{key_, findings.covers->element, findings.covers->number});
  }
  for (auto& found : findings.messages) {
    note(MessageEntry{key_, book_.last_number() + 1, found.element, std::move(found.text),
                      now.wall});
  }
  if (!findings.messages.empty()) {
    wait_for_journal();
  }
  if (findings.fine) {
    watch_filling(now);
  }
}

void Queue::wait_for_journal() {
  if (std::exchange(news_.wait, true)) {
    journalling_.pop_back();
  }
  journalling_.push_back(book_.last_number());
}

void Queue::on_journalled(Moment now) {
  settled_ = true;
  journalled_ = std::max(journalled_, journalling_.front());
  journalling_.pop_front();
  reader_.on_journalled(now);
  show_next();
}

void Queue::write(const Write& write, Moment now) {
  const auto shown = window_.shown();
  if (!window_.write(write)) {
    return;
  }
  note(MessageEndedEntry{key_, *shown});
  if (reader_.control()) {
    // Also while the controller does not answer.
    watch_filling(now);
  }
  if (settings_.drain == Drain::when_answered) {
    reader_.look_again(now);
  }
}

void Queue::on_acknowledged() {
  const QueueMessage* const next = book_.next();
  // What is not in the journal yet has no call.
  if (next != nullptr && next->number <= journalled_) {
    show_next();
  }
}

void Queue::watch_filling(Moment now) {
  const Control& control = *reader_.control();
  const std::size_t places = control.elements - 1;
  const bool ring = is_filling(filled(control), places);
  const bool backlog = is_filling(book_.waiting(), settings_.backlog);
  if (!ring && !backlog) {
    filling_since_.reset();
    if (std::size_t{filled(control)} * 2 <= places && book_.waiting() * 2 <= settings_.backlog &&
        std::exchange(filling_said_, false)) {
      news_.lines.push_back({Level::info, fmt::format("{} has room again", settings_.array)});
      news_.filling = std::string();
    }
    return;
  }
  if (!filling_since_) {
    filling_since_ = now.steady;
  }
  if (!filling_said_ && (backlog || now.steady - *filling_since_ >= patience)) {
    filling_said_ = true;
    const std::string words = filling_words(settings_, control, book_.waiting(), key_.to_string());
    news_.lines.push_back({Level::warn, words});
    news_.filling = fmt::format("{}: {}", key_.to_string(), words);
  }
}

QueueView Queue::view() const {
  return {reader_.control(), book_.last_number(), book_.ended(),           book_.waiting(),
          trouble_,          window_.response(),  window_.response_state()};
}

}  // namespace millrace::gateway::queues
