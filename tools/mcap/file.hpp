// MCAP files on disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "base/posix/system.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

/// A file to read. Its size is taken when it is opened; what is cut off later reads as missing.
class FileSource : public Source {
 public:
  /// The error names the file and the reason.
  static tl::expected<FileSource, std::string> open(const std::filesystem::path& path);
  /// The same for a file that is open already; `descriptor` is the source's from now on, also if it
  /// fails. `name` is for messages.
  static tl::expected<FileSource, std::string> adopt(int descriptor,
                                                     const std::filesystem::path& name);

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::uint64_t length, std::string& out) override;

 private:
  FileSource(base::posix::Fd fd, std::uint64_t size) : fd_(std::move(fd)), size_(size) {}

  base::posix::Fd fd_;
  std::uint64_t size_;
};

/// A new file to write. It grows under the name "FILE.part" and gets its own when it is finished,
/// so a file under its own name is always whole; otherwise the ".part" file stays.
class FileSink : public Sink {
 public:
  /// Fails if either name exists already. Until it is finished the ".part" file is locked (flock),
  /// so that no process takes it for a leftover.
  static tl::expected<FileSink, std::string> create(const std::filesystem::path& path);

  tl::expected<void, std::string> write(Bytes bytes) override;
  /// Forces the written bytes to the disk.
  tl::expected<void, std::string> sync();
  /// Syncs, closes and renames.
  tl::expected<void, std::string> finish();
  /// Closes and removes it.
  void discard();

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  FileSink(base::posix::Fd fd, std::filesystem::path path)
      : fd_(std::move(fd)), path_(std::move(path)) {}

  base::posix::Fd fd_;
  std::filesystem::path path_;
  /// Of what was taken whole.
  std::uint64_t size_ = 0;
};

/// Whether a process still writes this ".part" file.
bool is_being_written(const std::filesystem::path& part);

/// "run.mcap" → "run.mcap.part".
std::filesystem::path part_of(const std::filesystem::path& path);

}  // namespace millrace::tools::mcap
