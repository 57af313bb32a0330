#include "base/posix/files.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/posix/system.hpp"

namespace millrace::base::posix {

namespace {

namespace fs = std::filesystem;
using Result = tl::expected<void, std::string>;

Result failed(std::string_view step, const fs::path& file) {
  return tl::unexpected(last_error(std::string(step) + " " + file.string()));
}

bool write_all(int fd, std::string_view content) {
  while (!content.empty()) {
    const ssize_t count = ::write(fd, content.data(), content.size());
    if (count < 0 && errno != EINTR) {
      return false;
    }
    content.remove_prefix(count < 0 ? 0 : static_cast<std::size_t>(count));
  }
  return true;
}

/// A new name is durable only once its folder is.
Result sync_folder(const fs::path& file) {
  const fs::path folder = file.has_parent_path() ? file.parent_path() : fs::path(".");
  const Fd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.get()) != 0) {
    return failed("cannot make the folder durable", folder);
  }
  return {};
}

Result write_new(const fs::path& file, std::string_view content, mode_t mode) {
  // What is there is left over, or a link that leads elsewhere.
  ::unlink(file.c_str());
  const Fd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode));
  if (!fd) {
    return failed("cannot create", file);
  }
  if (!write_all(fd.get(), content)) {
    return failed("cannot write", file);
  }
  if (::fsync(fd.get()) != 0) {
    return failed("cannot make durable", file);
  }
  return {};
}

}  // namespace

Result write_durably(const fs::path& file, std::string_view content, mode_t mode) {
  fs::path temporary = file;
  temporary += ".part";
  Result done =
      write_new(temporary, content, mode).and_then([&] { return rename_durably(temporary, file); });
  if (!done) {
    ::unlink(temporary.c_str());
  }
  return done;
}

Result rename_durably(const fs::path& from, const fs::path& to) {
  if (std::rename(from.c_str(), to.c_str()) != 0) {
    return failed("cannot rename to", to);
  }
  Result done = sync_folder(to);
  if (done && from.parent_path() != to.parent_path()) {
    done = sync_folder(from);
  }
  return done;
}

FileIdentity identity_of(const std::filesystem::path& file) {
  struct stat status {};
  return ::stat(file.c_str(), &status) == 0 ? FileIdentity(status.st_dev, status.st_ino)
                                            : FileIdentity{};
}

Fd lock_folder(const std::filesystem::path& folder, const std::string& name,
               std::string_view taken) {
  const std::filesystem::path file = folder / name;
  Fd fd(::open(file.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0640));
  if (!fd) {
    throw std::runtime_error(last_error("cannot open " + file.string()));
  }
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    throw std::runtime_error(errno == EWOULDBLOCK ? folder.string() + ": " + std::string(taken)
                                                  : last_error("cannot lock " + file.string()));
  }
  return fd;
}

namespace {

constexpr mode_t new_file = 0640;

tl::unexpected<std::string> refused(std::string why) {
  return tl::unexpected(std::move(why));
}

tl::unexpected<std::string> last_reason() {
  const int error = errno;
  return refused(error == ELOOP || error == ENOTDIR
                     ? "a part of its path is a symbolic link or not a folder"
                     : std::generic_category().message(error));
}

char lower(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool same_but_for_case(std::string_view left, std::string_view other) {
  return std::ranges::equal(left, other, {}, lower, lower);
}

/// The entry of a folder with this name, case-insensitive.
std::optional<std::filesystem::path> entry_of(const std::filesystem::path& folder,
                                              const std::filesystem::path& name) {
  std::error_code error;
  if (std::filesystem::exists(std::filesystem::symlink_status(folder / name, error))) {
    return name;
  }
  std::optional<std::filesystem::path> best;
  std::filesystem::directory_iterator entries(folder, error);
  for (; !error && entries != std::filesystem::directory_iterator(); entries.increment(error)) {
    const std::filesystem::path entry = entries->path().filename();
    if (same_but_for_case(entry.native(), name.native()) && (!best || entry < *best)) {
      best = entry;
    }
  }
  return best;
}

/// Why the name is refused; empty if it is valid.
std::string mistake_of(const std::filesystem::path& name) {
  if (name.is_absolute() || !name.has_filename()) {
    return "it is outside of the folder, or not a file name";
  }
  for (const auto& part : name) {
    if (part == "..") {
      return "it is outside of the folder, or not a file name";
    }
    if (part.native().starts_with('.')) {
      return "names that begin with a dot are not accepted";
    }
  }
  return "";
}

}  // namespace

tl::expected<Fd, std::string> open_beneath(const std::filesystem::path& folder,
                                           const std::filesystem::path& name, int flags) {
  if (std::string mistake = mistake_of(name); !mistake.empty()) {
    return refused(std::move(mistake));
  }
  Fd place(::open(folder.empty() ? "." : folder.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  if (!place) {
    return last_reason();
  }
  // Step by step, so that no link is followed; openat2(2) would do it at once, where it is allowed.
  for (const auto& part : name.parent_path()) {
    Fd next(::openat(place.get(), part.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
    if (!next) {
      return last_reason();
    }
    place = std::move(next);
  }
  // A pipe without a reader, or a device, does not block.
  Fd file(::openat(place.get(), name.filename().c_str(),
                   flags | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, new_file));
  if (!file) {
    return last_reason();
  }
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) {
    return last_reason();
  }
  if (!S_ISREG(status.st_mode)) {
    return refused("it is not a regular file");
  }
  if ((flags & O_ACCMODE) != O_RDONLY && status.st_nlink > 1) {
    return refused("it has more than one hard link");
  }
  return file;
}

std::optional<std::filesystem::path> find_ignoring_case(const std::filesystem::path& folder,
                                                        const std::filesystem::path& name) {
  if (!mistake_of(name).empty()) {
    return std::nullopt;
  }
  const std::filesystem::path start = folder.empty() ? "." : folder;
  std::filesystem::path found;
  for (const auto& part : name) {
    const auto entry = entry_of(start / found, part);
    if (!entry) {
      return std::nullopt;
    }
    found /= *entry;
  }
  return found;
}

}  // namespace millrace::base::posix
