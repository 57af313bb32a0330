#include "base/posix/output_file.hpp"

#include <cerrno>
#include <cstring>
#include <iostream>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/posix/system.hpp"

namespace millrace::base::posix {

OutputFile::~OutputFile() {
  if (draft_ != file_) {
    ::unlink(draft_.c_str());
  }
}

tl::expected<void, std::string> OutputFile::open(std::string file) {
  file_ = std::move(file);
  draft_ = file_;
  if (file_.empty()) {
    return {};
  }
  struct stat status {};
  const bool is_there = ::stat(file_.c_str(), &status) == 0;
  if (!is_there || S_ISREG(status.st_mode)) {
    draft_ += ".part";
    // What is there is left over, or a link that leads elsewhere.
    ::unlink(draft_.c_str());
    const Fd fd(::open(draft_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!fd || (is_there && ::fchmod(fd.get(), status.st_mode & ACCESSPERMS) != 0)) {
      return unwritten(errno);
    }
  }
  stream_.open(draft_, std::ios::binary | std::ios::trunc);
  if (!stream_) {
    return unwritten(errno);
  }
  return {};
}

std::ostream& OutputFile::stream() {
  return file_.empty() ? std::cout : stream_;
}

tl::expected<void, std::string> OutputFile::finish() {
  errno = 0;
  stream().flush();
  if (!stream()) {
    return unwritten(errno);
  }
  if (draft_ != file_) {
    stream_.close();
    if (!stream_ || std::rename(draft_.c_str(), file_.c_str()) != 0) {
      return unwritten(errno);
    }
    draft_ = file_;
  }
  return {};
}

tl::unexpected<std::string> OutputFile::unwritten(int error) const {
  return tl::unexpected((file_.empty() ? "standard output" : draft_) + " cannot be written" +
                        (error == 0 ? "" : ": " + std::string(std::strerror(error))));
}

}  // namespace millrace::base::posix
