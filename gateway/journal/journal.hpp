// Where the gateway stores its calls: in memory, or in a file that survives a restart.
//
//   auto journal = open_file(executor, {.folder = "/var/lib/millrace"}, log);   // or in_memory(…)
//   Core core(fabric, host, options, journal->state());
//   journal->on_recorded([](const Ticket& ticket) { /* its entry is as safe as promised */ });
//   journal->append(entry, ticket);
#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include <boost/asio/any_io_executor.hpp>

#include "base/program/log.hpp"
#include "gateway/journal/journal_state.hpp"
#include "gateway/journal/journal_writer.hpp"
#include "gateway/journal_entry.hpp"

namespace millrace::gateway::journal {

/// Used on its executor only.
class Journal {
 public:
  virtual ~Journal() = default;
  /// All that is remembered, with the entries just appended.
  [[nodiscard]] virtual const JournalState& state() const = 0;
  /// `ticket` comes back on the executor, never from within append(). While nothing can be written
  /// it waits, and a ticket that waits for the disk may come after those of later entries that do
  /// not.
  virtual void append(const JournalEntry& entry, const Ticket& ticket) = 0;
  /// Set it before the first entry with a ticket.
  virtual void on_recorded(std::function<void(const Ticket&)> handler) = 0;
  /// Called when the journal cannot be written any more, with the reason, and with an empty text
  /// when it can again.
  virtual void on_write_error(std::function<void(const fabric::Message&)> handler) = 0;
};

/// A journal that ends with the process: a call under way is then dispatched a second time, under a
/// new id, and an answer that was being written may be lost.
std::unique_ptr<Journal> in_memory(boost::asio::any_io_executor executor);

/// FOLDER/calls.journal, created if it does not exist; a torn end is cut off and logged. Throws
/// std::runtime_error if the folder cannot be used, another gateway has it, or the file is not a
/// millrace journal.
std::unique_ptr<Journal> open_file(boost::asio::any_io_executor executor, FileOptions options,
                                   base::program::Log log);

// The epoch of a new journal.

/// 48 random bits, never 0: no two journals share their call ids.
std::uint64_t draw_epoch();

}  // namespace millrace::gateway::journal
