// A disk that distinguishes forced from merely written data: it gives what a power cut leaves of a
// folder, at each point of a test.
//
//   PowerCutDisk disk(folder);
//   spool.put(entry);
//   disk.promise(1);                     // from here on a power cut must not lose it
//   for (const auto& left : disk.power_cuts()) {
//     left.restore(other);               // what the next process finds
//     EXPECT_TRUE(holds_what_was_promised(other, left.promised)) << left.where;
//   }
//
// It replaces the C library's open, write, pwrite, ftruncate, rename, remove, unlink, fsync and
// fdatasync in a program that is linked with it. It assumes only what is documented of a disk:
// fsync(2) and fdatasync(2) force a file's bytes, fsync of a folder forces its names. Anything else
// that was written may survive or not, names and bytes separately.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace millrace::tests {

/// What may remain if the power is cut before one change of the disk.
struct PowerCut {
  /// "before fsync calls.journal.new, with what was only written to names".
  std::string where;
  /// The last promise before it.
  unsigned promised = 0;
  std::map<std::string, std::string> files{};

  /// Makes `folder` hold these files and no others.
  void restore(const std::filesystem::path& folder) const;
};

class PowerCutDisk {
 public:
  /// Watches the files of `folder`, which exists, until it is destroyed. Only one at a time.
  explicit PowerCutDisk(const std::filesystem::path& folder);
  ~PowerCutDisk();
  PowerCutDisk(const PowerCutDisk&) = delete;
  PowerCutDisk& operator=(const PowerCutDisk&) = delete;

  /// Records that everything up to `number`, which the test counts itself, is acknowledged.
  void promise(unsigned number);
  /// The power cuts before each change so far, and now; equal ones are listed once.
  [[nodiscard]] std::vector<PowerCut> power_cuts();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
