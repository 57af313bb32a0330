#include "base/posix/beneath.hpp"

#include <cerrno>
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
  return refused(error == ELOOP || error == ENOTDIR ? "a link or no folder is on the way to it"
                                                    : std::generic_category().message(error));
}

/// Why no such name is opened, or nothing.
std::string mistake_of(const std::filesystem::path& name) {
  if (name.is_absolute() || !name.has_filename()) {
    return "it is outside of the folder, or no name of a file";
  }
  for (const auto& part : name) {
    if (part == "..") {
      return "it is outside of the folder, or no name of a file";
    }
    if (part.native().starts_with('.')) {
      return "a name that begins with a dot is not looked at";
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
  // Neither a pipe without a reader nor a device makes anybody wait.
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
    return refused("it is no plain file");
  }
  if ((flags & O_ACCMODE) != O_RDONLY && status.st_nlink > 1) {
    return refused("it has another name, too (a hard link)");
  }
  return file;
}

}  // namespace millrace::base::posix
