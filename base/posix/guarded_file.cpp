#include "base/posix/guarded_file.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/posix/system.hpp"

namespace millrace::base::posix {

namespace {

std::optional<FileFault> fault_of_writers(const std::filesystem::path& path, mode_t mode,
                                          mode_t forbidden) {
  if ((mode & forbidden) == 0) {
    return {};
  }
  const std::string advice =
      "`chmod go-w " + path.string() + "`, and replace it if others may have changed it";
  if ((mode & S_IWOTH) == 0) {
    return FileFault{"its group can write it", advice};
  }
  // Such mounts show 0777 for each file.
  return FileFault{"all users of this host can write it",
                   advice +
                       "; where a mount ignores chmod (Docker Desktop for Windows), copy it "
                       "into the image or a named volume"};
}

/// Why a file was not read; `error` is 0 if the reason is its kind or size.
struct Unread {
  std::string reason;
  int error = 0;
};

Unread unread_now() {
  const int error = errno;
  return {std::strerror(error), error};
}

tl::expected<std::string, Unread> read(const std::filesystem::path& file,
                                       std::size_t most = largest_file) {
  const Fd fd(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0) {
    return tl::unexpected(unread_now());
  }
  if (!S_ISREG(status.st_mode)) {
    return tl::unexpected(Unread{"it is not a regular file"});
  }
  std::string text;
  std::array<char, 16384> part{};
  while (true) {
    const ssize_t size = ::read(fd.get(), part.data(), part.size());
    if (size == 0) {
      return text;
    }
    if (size < 0 && errno != EINTR) {
      return tl::unexpected(unread_now());
    }
    text.append(part.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    if (text.size() > most) {
      return tl::unexpected(Unread{"it has more than " + std::to_string(most >> 20U) + " MiB"});
    }
  }
}

std::optional<FileFault> fault_of(const std::filesystem::path& file, Secrecy secrecy) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) {
    return {};  // reading it reports the reason
  }
  if (!S_ISREG(status.st_mode)) {
    return FileFault{"is not a regular file", "name a file"};
  }
  if (secrecy == Secrecy::secret && (status.st_mode & S_IROTH) != 0) {
    return FileFault{
        "is a secret, and all users of this host can read it",
        "`chmod o= " + file.string() + "`, and make a new one if others may have seen it"};
  }
  return fault_of_writers(file, status.st_mode,
                          secrecy == Secrecy::secret ? S_IWGRP | S_IWOTH : S_IWOTH);
}

}  // namespace

tl::expected<std::string, std::string> read_regular(const std::filesystem::path& file,
                                                    std::size_t most) {
  return read(file, most).map_error([](Unread unread) { return std::move(unread.reason); });
}

tl::expected<std::string, std::string> read_first_line(const std::filesystem::path& file) {
  return read_regular(file).and_then(
      [](std::string text) -> tl::expected<std::string, std::string> {
        if (text.empty()) {
          return tl::unexpected(std::string("it is empty"));
        }
        text.resize(std::min(text.find('\n'), text.size()));
        if (text.ends_with('\r')) {
          text.pop_back();
        }
        return text;
      });
}

tl::expected<std::string, FileFault> read_guarded(const std::filesystem::path& file,
                                                  Secrecy secrecy) {
  if (auto fault = fault_of(file, secrecy)) {
    return tl::unexpected(*std::move(fault));
  }
  return read(file).map_error([](const Unread& unread) {
    return FileFault{
        "cannot be read (" + unread.reason + ")",
        unread.error == EACCES
            ? "it and its folder have to be readable for the user of this program: see "
              "`chown` and `chmod`"
            : ""};
  });
}

std::optional<FileFault> fault_of_folder(const std::filesystem::path& folder) {
  struct stat status {};
  if (::stat(folder.c_str(), &status) != 0 || (status.st_mode & S_ISVTX) != 0) {
    return {};
  }
  return fault_of_writers(folder, status.st_mode, S_IWOTH);
}

}  // namespace millrace::base::posix
