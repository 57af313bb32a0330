#include "base/posix/beneath.hpp"

#include <algorithm>
#include <cerrno>
#include <string_view>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>

namespace millrace::base::posix {

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

bool same_but_for_case(std::string_view one, std::string_view other) {
  return std::ranges::equal(one, other, {}, lower, lower);
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
