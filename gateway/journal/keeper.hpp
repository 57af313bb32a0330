// Decides what the journal's file holds and when a step is safe. No disk, thread or clock of its
// own: the disk is a Storage, time comes as ticks.
//
//   Keeper keeper(storage, options);
//   if (auto loaded = keeper.load(bytes); !loaded) …    // the file is none of ours
//   keeper.append(entry, [] { /* as safe as the policy promises */ });
//   keeper.on_tick();                                   // once a period
//
// When anything fails, the whole journal is written anew once a period until that works: what a
// disk kept of a failed write is not known.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "gateway/journal/ledger.hpp"
#include "gateway/journal/options.hpp"
#include "gateway/journal_entry.hpp"

namespace millrace::gateway::journal {

/// Empty if nobody waits for it.
using Recorded = std::function<void()>;

/// One file on a disk. Errors are words that go after "the journal ".
class Storage {
 public:
  virtual ~Storage() = default;
  virtual tl::expected<void, std::string> append(std::string_view bytes) = 0;
  /// In one step, even if the power fails meanwhile; forced to the disk.
  virtual tl::expected<void, std::string> replace(std::string_view bytes) = 0;
  /// Forces what was appended to the disk; answered by one Keeper::on_forced, never from within.
  virtual void start_force() = 0;
  /// Calls these soon, in their order, never from within.
  virtual void confirm(std::vector<Recorded> recorded) = 0;
  /// The journal cannot write any more, with the reason; or, with an empty text, can again.
  virtual void tell(const std::string& trouble) = 0;
};

class Keeper {
 public:
  /// `storage` must outlive the keeper.
  Keeper(Storage& storage, FileOptions options) : storage_(storage), options_(std::move(options)) {}

  /// What the file holds when the gateway starts, and an epoch for a new journal. The damage that
  /// was cut off in words, empty if there was none; an error if the file is no journal of ours.
  tl::expected<std::string, std::string> load(std::string_view bytes, std::uint64_t new_epoch);
  /// Writes the file anew, as short as it can be.
  tl::expected<void, std::string> rewrite();

  void append(const JournalEntry& entry, Recorded recorded);
  /// Once a period: forces, shortens, or tries again after trouble.
  void on_tick();
  /// The answer to start_force; `failure` is empty if it worked.
  void on_forced(const std::string& failure);

  [[nodiscard]] const Ledger& ledger() const { return ledger_; }

 private:
  void recover();
  void shorten();
  void start_forcing();
  void fail(const std::string& reason);

  Storage& storage_;
  FileOptions options_;
  Ledger ledger_;
  std::size_t size_ = 0;
  bool dirty_ = false;
  bool forcing_ = false;
  /// Covered by the force under way, and by the next one.
  std::vector<Recorded> batch_;
  std::vector<Recorded> waiting_;
  std::string trouble_;
};

}  // namespace millrace::gateway::journal
