#include "tools/mcap/file.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace millrace::tools::mcap {

namespace {

using base::posix::Fd;

tl::unexpected<std::string> failure(const std::string& what, const std::filesystem::path& path) {
  return tl::unexpected("cannot " + what + " " + path.string() + ": " + std::strerror(errno));
}

/// Forces the names of the folder's files to the disk.
void sync_folder_of(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  if (const Fd open(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)); open) {
    ::fsync(open.get());
  }
}

}  // namespace

tl::expected<FileSource, std::string> FileSource::open(const std::filesystem::path& path) {
  // A pipe would wait for its writer.
  return adopt(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC), path);
}

tl::expected<FileSource, std::string> FileSource::adopt(int descriptor,
                                                        const std::filesystem::path& path) {
  Fd fd(descriptor);
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0) {
    return failure("read", path);
  }
  if (!S_ISREG(status.st_mode)) {
    return tl::unexpected("cannot read " + path.string() + ": it is not a file");
  }
  return FileSource(std::move(fd), static_cast<std::uint64_t>(status.st_size));
}

void FileSource::read(std::uint64_t offset, std::uint64_t length, std::string& out) {
  const std::uint64_t available = offset < size_ ? size_ - offset : 0;
  out.resize(static_cast<std::size_t>(std::min(length, available)));
  std::size_t done = 0;
  while (done < out.size()) {
    const ssize_t got =
        ::pread(fd_.get(), out.data() + done, out.size() - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) {
      continue;
    }
    if (got <= 0) {
      break;
    }
    done += static_cast<std::size_t>(got);
  }
  out.resize(done);
}

tl::expected<FileSink, std::string> FileSink::create(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) {
    errno = EEXIST;
    return failure("write", path);
  }
  Fd fd(::open(part_of(path).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (!fd) {
    return failure("write", part_of(path));
  }
  ::flock(fd.get(), LOCK_EX | LOCK_NB);
  // After a power failure, a synced file is found only if its name is on the disk too.
  sync_folder_of(path);
  return FileSink(std::move(fd), path);
}

tl::expected<void, std::string> FileSink::write(Bytes bytes) {
  const std::uint64_t whole = size_ + bytes.size();
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd_.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written < 0) {
      auto why = failure("write", part_of(path_));
      // A half-written record is of no use to a reader, and takes space.
      static_cast<void>(::ftruncate(fd_.get(), static_cast<off_t>(size_)));
      ::lseek(fd_.get(), static_cast<off_t>(size_), SEEK_SET);
      return why;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  size_ = whole;
  return {};
}

tl::expected<void, std::string> FileSink::sync() {
  if (::fdatasync(fd_.get()) != 0) {
    return failure("write", part_of(path_));
  }
  return {};
}

tl::expected<void, std::string> FileSink::finish() {
  if (auto synced = sync(); !synced) {
    return synced;
  }
  fd_.close();
  std::error_code error;
  std::filesystem::rename(part_of(path_), path_, error);
  if (error) {
    errno = error.value();
    return failure("rename the finished file to", path_);
  }
  sync_folder_of(path_);
  return {};
}

void FileSink::discard() {
  if (fd_) {
    fd_.close();
    std::error_code none;
    std::filesystem::remove(part_of(path_), none);
  }
}

bool is_being_written(const std::filesystem::path& part) {
  const Fd fd(::open(part.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC));
  return fd && ::flock(fd.get(), LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
}

std::filesystem::path part_of(const std::filesystem::path& path) {
  std::filesystem::path part = path;
  part += ".part";
  return part;
}

}  // namespace millrace::tools::mcap
