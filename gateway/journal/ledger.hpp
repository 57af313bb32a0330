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
  /// Entries that lead to the same ledger.
  [[nodiscard]] std::vector<JournalEntry> snapshot() const;

 private:
  void open(const DispatchedEntry& entry);

  NumbersEntry numbers_;
  std::map<fabric::CallId, Call> calls_;
};

}  // namespace millrace::gateway::journal
