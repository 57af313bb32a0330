#include "base/posix/durable_file.hpp"

#include <cerrno>
#include <cstdio>

#include <fcntl.h>
#include <unistd.h>

#include "base/posix/fd.hpp"

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
  const Fd fd(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, mode));
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

Result remove_durably(const fs::path& file) {
  if (::unlink(file.c_str()) != 0) {
    return errno == ENOENT ? Result{} : failed("cannot remove", file);
  }
  return sync_folder(file);
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

}  // namespace millrace::base::posix
