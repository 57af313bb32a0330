// Decides which samples of a fabric are written when, and to which file.
//
//   Recorder recorder(options);
//   recorder.start(now);
//   recorder.on_entry(entry, now);           // each entry, as it comes
//   recorder.tick(now);                      // some times a second
//   recorder.finish(delivered, lost, now);
//
// After an error nothing more can be written; the closed chunks of the file can be repaired. A full
// disk is not an error: refused chunks stay in memory until there is space, or the end.
#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <tl/expected.hpp>

#include "tools/recorder/options.hpp"
#include "tools/recorder/recording_file.hpp"
#include "tools/recorder/series.hpp"
#include "tools/recording/completeness.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recorder {

// The newest entries, limited in time and memory. Pure.

class Ring {
 public:
  Ring(std::chrono::nanoseconds length, std::uint64_t size) : length_(length), size_(size) {}

  /// Adds an entry and drops what is too old or too much. Age is counted from the newest entry.
  void add(recording::Entry entry);
  /// Passes everything to `use`, oldest first, and is empty afterwards.
  void take(const std::function<void(const recording::Entry&)>& use);

  [[nodiscard]] std::size_t count() const { return entries_.size(); }

 private:
  void drop_oldest();

  std::chrono::nanoseconds length_;
  std::uint64_t size_;
  std::deque<recording::Entry> entries_;
  std::uint64_t used_ = 0;
};

/// The entries that came in, by their end: written to a file, filtered out, or dropped: by a
/// window, or because the disk was full.
struct Tally {
  std::uint64_t received = 0;
  std::uint64_t written = 0;
  std::uint64_t filtered = 0;
  std::uint64_t let_go = 0;
  std::uint64_t failures = 0;
};

class Recorder {
 public:
  using Result = tl::expected<void, std::string>;
  using Moment = std::chrono::steady_clock::time_point;
  /// Bytes left on the disk of a path.
  using FreeSpace = std::function<std::uint64_t(const std::filesystem::path&)>;

  explicit Recorder(Options options, FreeSpace free_space = disk_space);

  /// Begins the first file, unless a window waits for a failure first.
  Result start(Moment now);
  Result on_entry(recording::Entry entry, Moment now);
  /// Closes chunks and files that are due.
  Result tick(Moment now);
  /// Ends the recording in order, at `now` of the clock of the entries. `delivered` and `lost` are
  /// the observer's counts.
  Result finish(std::uint64_t delivered, std::uint64_t lost, fabric::Time now);

  [[nodiscard]] Tally tally() const;
  /// The missing samples of calls that are over, as far as other samples show.
  [[nodiscard]] const recording::Missing& missing() const { return completeness_.missing(); }
  /// True when the disk has too little space left. A recording of one file should be finished then;
  /// one of many closes its file if it can, drops further entries, and continues when there is
  /// space.
  [[nodiscard]] bool disk_is_full() const { return disk_is_full_; }
  [[nodiscard]] bool waits_for_room() const { return waits_for_room_; }
  /// The free space on the disk at the last check; nullopt before the first.
  [[nodiscard]] std::optional<std::uint64_t> free_space() const { return free_; }
  /// The file being written; nullopt while there is none.
  [[nodiscard]] std::optional<std::filesystem::path> writes() const {
    return file_ && !waits_for_room_ ? std::optional(file_->path()) : std::nullopt;
  }
  /// Files that were removed to make room for newer ones, since the last call.
  [[nodiscard]] std::vector<std::filesystem::path> take_removed() {
    return std::exchange(removed_, {});
  }
  /// The finished files.
  [[nodiscard]] const std::vector<std::filesystem::path>& files() const { return files_; }

  /// Of the file system; 0 if it cannot be asked.
  static std::uint64_t disk_space(const std::filesystem::path& path);

 private:
  Result keep(recording::Entry entry, Moment now);
  Result do_what_is_due(Moment now);
  /// A full disk is not a failure: the recorder waits, or continues with the memory that it has.
  Result unless_full(Result result, Moment now);
  /// Continues with the present file, or else the next one.
  Result go_on(Moment now);
  Result begin_file(Moment now);
  Result end_file(const std::map<std::string, std::string>& more);
  Result write(const recording::Entry& entry, Moment now);
  Result write_window(Moment now);
  Result close_chunk(bool sync);
  Result rotate_if_due(Moment now);
  /// Removes closed files, the oldest first but never the newest, as long as `too_much`.
  void make_room(const std::function<bool()>& too_much);
  void keep_to_size();
  void check_disk();
  [[nodiscard]] bool has_many_files() const {
    return options_.rotate_size > 0 || options_.rotate_time.count() > 0;
  }
  /// Ends the file because the disk is full, or begins one when there is space again.
  Result wait_for_room(Moment now);

  Options options_;
  FreeSpace free_space_;
  Series series_;
  std::optional<Ring> ring_;
  std::unique_ptr<RecordingFile> file_;
  unsigned file_number_ = 0;
  Moment file_begun_{};
  /// The first entry of the open chunk came then.
  std::optional<Moment> dirty_since_;
  /// With a window: everything is written until then.
  Moment write_until_ = Moment::min();
  std::optional<std::uint64_t> free_;
  bool disk_is_full_ = false;
  bool waits_for_room_ = false;
  Tally tally_;
  recording::Completeness completeness_;
  /// In the finished files.
  std::uint64_t written_ = 0;
  std::vector<std::filesystem::path> files_;
  std::vector<std::filesystem::path> removed_;
};

}  // namespace millrace::tools::recorder
