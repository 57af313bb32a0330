// Where a command writes its result: standard output, or a file that people name.
//
//   OutputFile out;
//   if (const auto opened = out.open("calls.csv"); !opened) … opened.error()
//   out.stream() << row;
//   if (const auto done = out.finish(); !done) … done.error()
#pragma once

#include <fstream>
#include <iosfwd>
#include <string>

#include <tl/expected.hpp>

namespace millrace::base::posix {

/// A file is replaced as a whole by finish(), or not at all; a link of its name is replaced, not
/// followed. A pipe or a device is written directly.
class OutputFile {
 public:
  OutputFile() = default;
  /// Removes what is not finished.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// No name is standard output. The error is for people.
  tl::expected<void, std::string> open(std::string file);
  [[nodiscard]] std::ostream& stream();
  /// Everything is written, and the file has its name. The error is for people.
  tl::expected<void, std::string> finish();

 private:
  [[nodiscard]] tl::unexpected<std::string> unwritten(int error) const;

  std::string file_;
  /// Its name until it is finished; equal to `file_` if it is written directly.
  std::string draft_;
  std::ofstream stream_;
};

}  // namespace millrace::base::posix
