// The sum of a journal's entries: the open calls, and the used call numbers.
//
//   JournalState state;
//   for (const Entry& entry : contents.entries) state.apply(entry);
//   for (const CallRecord& call : state.open_calls()) …      // resume them
//   for (const Entry& entry : state.snapshot()) …      // a journal as short as it can be
#pragma once

#include <map>
#include <vector>

#include "gateway/call_record.hpp"
#include "gateway/journal_entry.hpp"
#include "gateway/queue_log.hpp"

namespace millrace::gateway::journal {

/// Its calls are copies of the core's: what was appended, not what is so now. The core notes a step
/// when it is confirmed or shown, and has no record of a call that it left to be found again; a
/// shortened file must still have both (docs/dev/decisions/values.md).
class JournalState {
 public:
  /// An entry of a call that no Dispatched entry has opened is ignored: its call ended before the
  /// journal was last shortened.
  void apply(const JournalEntry& entry);

  /// Zero in a new journal.
  [[nodiscard]] const NumbersEntry& numbers() const { return numbers_; }
  /// In the order they were claimed; at most one for each channel.
  [[nodiscard]] std::vector<CallRecord> open_calls() const;
  /// The state of message queues, by their keys.
  [[nodiscard]] const std::map<fabric::ChannelKey, QueueLog>& queues() const { return queues_; }
  /// The blocked channels.
  [[nodiscard]] const std::map<fabric::ChannelKey, BlockedEntry>& blocked() const {
    return blocked_;
  }
  /// Entries that lead to the same state.
  [[nodiscard]] std::vector<JournalEntry> snapshot() const;

 private:
  void open(const DispatchedEntry& entry);
  void end(const MessageEndedEntry& entry);

  NumbersEntry numbers_;
  std::map<fabric::CallId, CallRecord> calls_;
  std::map<fabric::ChannelKey, QueueLog> queues_;
  std::map<fabric::ChannelKey, BlockedEntry> blocked_;
};

}  // namespace millrace::gateway::journal
