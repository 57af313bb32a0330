#include "gateway/queue_log.hpp"

#include <algorithm>

namespace millrace::gateway {

void QueueLog::apply(const MessageEntry& entry) {
  messages_.push_back({entry.number, entry.element, entry.text, entry.seen});
  last_ = std::max(last_, entry.number);
}

void QueueLog::apply(const MessageEndedEntry& entry) {
  ended_ = std::max(ended_, entry.number);
  last_ = std::max(last_, entry.number);
  forget();
}

void QueueLog::apply(const LastGetEntry& entry) {
  last_get_ = entry.element;
  covered_ = std::max(covered_, entry.number);
  last_ = std::max(last_, entry.number);
  forget();
}

void QueueLog::forget() {
  while (!messages_.empty() && messages_.front().number <= std::min(ended_, covered_)) {
    messages_.pop_front();
  }
}

std::uint32_t QueueLog::read_up_to() const {
  const bool ahead = !messages_.empty() && messages_.back().number > covered_;
  return ahead ? messages_.back().element : last_get_.value_or(0);
}

const QueueMessage* QueueLog::next() const {
  const auto found = std::ranges::find_if(
      messages_, [this](const QueueMessage& message) { return message.number > ended_; });
  return found == messages_.end() ? nullptr : &*found;
}

std::size_t QueueLog::waiting() const {
  return static_cast<std::size_t>(last_ - ended_);
}

QueueLog::Messages QueueLog::uncovered() const {
  // Their numbers follow one another.
  const std::uint64_t first = messages_.empty() ? 0 : messages_.front().number;
  const std::uint64_t skipped = messages_.empty() || covered_ < first ? 0 : covered_ - first + 1;
  const auto size = static_cast<std::uint64_t>(messages_.size());
  return {messages_.begin() + static_cast<std::ptrdiff_t>(std::min(skipped, size)),
          messages_.end()};
}

std::vector<JournalEntry> QueueLog::snapshot(const fabric::ChannelKey& key) const {
  std::vector<JournalEntry> entries;
  if (last_get_) {
    entries.emplace_back(LastGetEntry{key, *last_get_, covered_});
  }
  for (const QueueMessage& message : messages_) {
    entries.emplace_back(
        MessageEntry{key, message.number, message.element, message.text, message.seen});
  }
  if (ended_ > 0) {
    entries.emplace_back(MessageEndedEntry{key, ended_});
  }
  return entries;
}

}  // namespace millrace::gateway
