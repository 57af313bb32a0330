// Decides the contents of the journal's file and when a step is safe. It has no disk, thread or
// clock of its own: the disk is a JournalFile, time comes as ticks.
//
//   JournalWriter writer(file, options);
//   if (auto loaded = writer.load(bytes, epoch); !loaded) …    // the file is none of ours
//   if (auto written = writer.begin(); !written) …             // the folder cannot be used
//   writer.append(entry, ticket);              → file.confirm({ticket}), at once or once forced
//   writer.on_tick();                                          // once a period
//
// The file grows until it is several times as long as the open calls need; then a new file with
// only these is written beside it and replaces it. Until the replacement the old file has
// everything, and from the moment it may have happened the new one does: entries in between go into
// both. So calls continue, and after a kill or a power failure one of the two files is complete.
//
// After any failure a new file is written once a period until that works, since the disk's contents
// after a failed write are unknown.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "gateway/journal/journal_state.hpp"
#include "gateway/journal_entry.hpp"

namespace millrace::gateway::journal {

// How a journal is stored in a file.

/// When entries are forced to the disk. A crash of the gateway loses nothing under any of them;
/// they differ in what a power cut may take.
enum class Sync : std::uint8_t {
  /// At times that the operating system chooses: the entries of the last half minute may be lost.
  never,
  /// Once a second: the entries of that second may be lost.
  interval,
  /// Before each next step: none are lost, for two waits for the disk in each call.
  always,
};

struct FileOptions {
  std::filesystem::path folder;
  Sync sync = Sync::interval;
  /// How often `interval` forces to the disk, and how often a full disk is tried again.
  std::chrono::milliseconds period{1000};
  /// A longer file is rewritten with open calls only, once it has several times the length that
  /// these need.
  std::size_t compact_at = std::size_t{1} << 20U;
  bool operator==(const FileOptions&) const = default;
};

/// The journal's file on a disk, and the new one that will replace it. Errors are phrases that
/// follow "the journal ". Slow operations are only started here, one at a time, and end with the
/// writer's function of that name, never from within.
class JournalFile {
 public:
  virtual ~JournalFile() = default;
  /// Rewrites the file and forces it to the disk. Only at the start: it blocks.
  virtual tl::expected<void, std::string> begin(std::string_view bytes) = 0;
  /// To the end of the file, as the operating system has it: a crash of the process loses nothing.
  virtual tl::expected<void, std::string> append(std::string_view bytes) = 0;
  /// The same to the end of the new file.
  virtual tl::expected<void, std::string> append_to_new_file(std::string_view bytes) = 0;
  /// Forces what was appended to the disk: JournalWriter::on_forced.
  virtual void start_force() = 0;
  /// Begins a new file with these entries, in the place of an earlier one:
  /// JournalWriter::on_new_file.
  virtual void start_new_file(std::vector<JournalEntry> entries) = 0;
  /// Forces the new file to the disk and replaces the file with it, atomically even if the power
  /// fails; from then on it is the file: JournalWriter::on_replaced.
  virtual void start_replace() = 0;
  /// Confirms these a little later, in order: their entries are as safe as promised.
  virtual void confirm(std::vector<Ticket> tickets) = 0;
  /// The journal cannot write any more, with the reason; or, with an empty text, can again.
  virtual void report_error(const fabric::Message& error) = 0;
};

class JournalWriter {
 public:
  /// `file` must outlive the writer.
  JournalWriter(JournalFile& file, FileOptions options);

  /// The file's contents when the gateway starts, and an epoch for a new journal. Returns the
  /// damage that was cut off, empty if there was none; an error if the file is not a millrace
  /// journal.
  tl::expected<std::string, std::string> load(std::string_view bytes, std::uint64_t new_epoch);
  /// Rewrites the file as short as possible, before the first append.
  tl::expected<void, std::string> begin();

  /// An entry that waits for the disk may be confirmed after later entries that do not.
  void append(const JournalEntry& entry, const Ticket& ticket);
  /// Once a period: forces, shortens, or tries again after a failure.
  void on_tick();

  /// The results of started operations; `failure` is empty if they worked.
  void on_forced(const std::string& failure);
  /// The length of the new file.
  void on_new_file(const tl::expected<std::size_t, std::string>& length);
  void on_replaced(const std::string& failure);

  [[nodiscard]] const JournalState& state() const { return state_; }

 private:
  // The job of the disk, with what only it needs.

  struct Forcing {
    std::vector<Ticket> batch;
  };
  /// A new file is written; `tail` has the entries that came since.
  struct Rewriting {
    std::string tail;
  };
  struct Replacing {
    std::vector<Ticket> batch;
    /// Of the new file: what the open calls need, and with all later entries.
    std::size_t needed = 0;
    std::size_t size = 0;
    /// Something could not be appended to it.
    bool spoiled = false;
  };
  using Job = std::variant<std::monostate, Forcing, Rewriting, Replacing>;

  void write(const std::string& bytes);
  void proceed();
  std::vector<Ticket> take_batch();
  void return_batch(std::vector<Ticket> batch);
  void fail(const std::string& reason);

  JournalFile& file_;
  FileOptions options_;
  JournalState state_;
  Job job_;
  /// Of the file; above the limit it is rewritten.
  std::size_t size_ = 0;
  std::size_t limit_ = 0;
  /// Something was appended that no force or replacement has covered.
  bool dirty_ = false;
  /// To be started when the disk has nothing else to do.
  bool force_due_ = false;
  bool new_file_due_ = false;
  /// Covered by the next force or replacement.
  std::vector<Ticket> waiting_;
  fabric::Message error_;
};

}  // namespace millrace::gateway::journal
