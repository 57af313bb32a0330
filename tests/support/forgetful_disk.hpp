// A disk that keeps what was forced to it apart from what was only written: what a power cut leaves
// of a folder, at each point of a test.
//
//   ForgetfulDisk disk(folder);
//   spool.put(entry);
//   disk.promise(1);                     // from here on a power cut must not lose it
//   for (const auto& left : disk.power_cuts()) {
//     left.restore(other);               // what the next process finds
//     EXPECT_TRUE(holds_what_was_promised(other, left.promised)) << left.where;
//   }
//
// A program that is linked with it calls it in place of the C library's open, write, pwrite,
// ftruncate, rename, remove, unlink, fsync and fdatasync. What is documented of a disk is taken at
// its word and no more is believed: fsync(2) and fdatasync(2) force a file's bytes, fsync of a
// folder forces its names. What else was written may be there or not, names and bytes apart.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace millrace::tests {

/// What may be left if the power is cut before one change of the disk.
struct PowerCut {
  /// "before fsync calls.journal.new, with what was only written to names".
  std::string where;
  /// The last promise before it.
  unsigned promised = 0;
  std::map<std::string, std::string> files{};

  /// Makes `folder` hold these files and no others.
  void restore(const std::filesystem::path& folder) const;
};

class ForgetfulDisk {
 public:
  /// Watches the files of `folder`, which is there, until it is destroyed. One at a time.
  explicit ForgetfulDisk(const std::filesystem::path& folder);
  ~ForgetfulDisk();
  ForgetfulDisk(const ForgetfulDisk&) = delete;
  ForgetfulDisk& operator=(const ForgetfulDisk&) = delete;

  /// What has been acknowledged by now, in the test's own counting.
  void promise(unsigned number);
  /// Before each change so far, and now; what is the same as before is there once.
  [[nodiscard]] std::vector<PowerCut> power_cuts();

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace millrace::tests
