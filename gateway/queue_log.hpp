// The journal's state of one message queue of a controller: messages without a response, and how
// far the queue was read.
//
//   QueueLog queue_log;
//   queue_log.apply(MessageEntry{key, 1, 2, "drill worn"});
//   queue_log.next()                               // the message to be called, number 1
//   queue_log.apply(MessageEndedEntry{key, 1});    // answered
//   queue_log.apply(LastGetEntry{key, 2, 1});      // LastGet is 2: number 1 is not read again
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <ranges>
#include <string>
#include <vector>

#include "gateway/journal_entry.hpp"

namespace millrace::gateway {

struct QueueMessage {
  std::uint64_t number = 0;
  std::uint32_t element = 0;
  std::string text;
  fabric::Time seen{};
  bool operator==(const QueueMessage&) const = default;
};

/// REQUEST_STATE of a message's call: the message's number, so that two messages with the same text
/// are two requests; never 0.
[[nodiscard]] constexpr std::uint32_t request_state_of(std::uint64_t number) {
  return static_cast<std::uint32_t>((number - 1) % 0xFFFFFFFFU) + 1;
}

class QueueLog {
 public:
  void apply(const MessageEntry& entry);
  void apply(const MessageEndedEntry& entry);
  void apply(const LastGetEntry& entry);

  /// LastGet as this gateway has seen or written it last; nothing before it has seen any.
  [[nodiscard]] const std::optional<std::uint32_t>& last_get() const { return last_get_; }
  /// The element read last: of the newest message that LastGet does not cover, else LastGet's.
  [[nodiscard]] std::uint32_t read_up_to() const;
  /// The first message that is not answered, or null.
  [[nodiscard]] const QueueMessage* next() const;
  /// Messages that are not answered.
  [[nodiscard]] std::size_t waiting() const;
  using Messages = std::ranges::subrange<std::deque<QueueMessage>::const_iterator>;
  /// The messages that LastGet does not cover, in their order; valid until the next entry.
  [[nodiscard]] Messages uncovered() const;
  /// The number of the last message, of the last that was answered, and of the last that LastGet
  /// covers; 0 = none.
  [[nodiscard]] std::uint64_t last_number() const { return last_; }
  [[nodiscard]] std::uint64_t ended() const { return ended_; }
  [[nodiscard]] std::uint64_t covered() const { return covered_; }
  /// Entries that lead to the same log.
  [[nodiscard]] std::vector<JournalEntry> snapshot(const fabric::ChannelKey& key) const;

  bool operator==(const QueueLog&) const = default;

 private:
  void forget();

  /// Not answered, or not covered.
  std::deque<QueueMessage> messages_;
  std::uint64_t last_ = 0;
  std::uint64_t ended_ = 0;
  std::uint64_t covered_ = 0;
  std::optional<std::uint32_t> last_get_;
};

}  // namespace millrace::gateway
