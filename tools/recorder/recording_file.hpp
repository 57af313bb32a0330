// One file of a recording while it is written.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "tools/mcap/file.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/mcap/writer.hpp"
#include "tools/recorder/options.hpp"
#include "tools/recording/hops.hpp"
#include "tools/recording/writer.hpp"

namespace millrace::tools::recorder {

/// The second metadata record of each recording, beside print::recorder_metadata.
inline constexpr const char* hops_metadata = "millrace.hops";

class RecordingFile {
 public:
  using Result = tl::expected<void, std::string>;

  /// Begins the file `path`, which grows as "PATH.part". Fails if it exists.
  static tl::expected<std::unique_ptr<RecordingFile>, std::string> create(
      const std::filesystem::path& path, const mcap::WriterOptions& options);

  RecordingFile(mcap::FileSink sink, const mcap::WriterOptions& options);

  Result write(const recording::Entry& entry);
  Result attach(const AttachedFile& file);
  /// Closes the chunk if there is one; `sync` forces it to the disk.
  Result close_chunk(bool sync);
  /// Adds `metadata` and the times of hops, closes and renames the file. May be tried again, with
  /// what was added the first time.
  Result finish(const std::map<std::string, std::string>& metadata);
  /// finish() was tried: nothing more can be written.
  [[nodiscard]] bool is_ending() const { return ending_; }

  [[nodiscard]] const std::filesystem::path& path() const { return sink_.path(); }
  [[nodiscard]] std::uint64_t size() const { return file_.size(); }
  [[nodiscard]] std::uint64_t messages() const { return file_.statistics().messages; }
  /// The number of those that are in the file, not only in memory.
  [[nodiscard]] std::uint64_t messages_taken() const { return file_.messages_taken(); }

 private:
  mcap::FileSink sink_;
  mcap::Writer file_;
  recording::RecordingWriter entries_;
  recording::HopStatistics hops_;
  bool ending_ = false;
};

// A complete recording from one that was cut or damaged.

/// mcap::repair_file(), with the recorder's counts counted again: some may be lost. The counts of
/// received and lost samples are unknown. A log of LCM becomes one with its whole events.
tl::expected<mcap::RepairReport, std::string> repair_recording(
    const std::filesystem::path& damaged, const std::filesystem::path& repaired,
    const std::string& library);

}  // namespace millrace::tools::recorder
