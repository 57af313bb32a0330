// What a journal adds up to: the calls that are still open, and which call numbers are used.
//
//   Ledger ledger;
//   for (const Entry& entry : contents.entries) ledger.apply(entry);
//   for (const Call& call : ledger.open_calls()) …      // resume them
//   for (const Entry& entry : ledger.snapshot()) …      // a journal as short as it can be
#pragma once

#include <map>
#include <vector>

#include "gateway/call.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/queue_book.hpp"

namespace millrace::gateway::journal {

class Ledger {
 public:
  /// An entry of a call that no Dispatched entry has opened is ignored: its call ended before the
  /// journal was last shortened.
  void apply(const JournalEntry& entry);

  /// Zero in a new journal.
  [[nodiscard]] const NumbersEntry& numbers() const { return numbers_; }
  /// In the order they were claimed; at most one for each channel.
  [[nodiscard]] std::vector<Call> open_calls() const;
  /// What is known of message queues, by the key of each.
  [[nodiscard]] const std::map<fabric::ChannelKey, QueueBook>& queues() const { return queues_; }
  /// The channels that stand.
  [[nodiscard]] const std::map<fabric::ChannelKey, StandingEntry>& standing() const {
    return standing_;
  }
  /// Entries that lead to the same ledger.
  [[nodiscard]] std::vector<JournalEntry> snapshot() const;

 private:
  void open(const DispatchedEntry& entry);
  void end(const MessageEndedEntry& entry);

  NumbersEntry numbers_;
  std::map<fabric::CallId, Call> calls_;
  std::map<fabric::ChannelKey, QueueBook> queues_;
  std::map<fabric::ChannelKey, StandingEntry> standing_;
};

}  // namespace millrace::gateway::journal
