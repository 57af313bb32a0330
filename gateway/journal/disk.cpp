#include "gateway/journal/disk.hpp"

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

namespace millrace::gateway::journal {

namespace {

using base::posix::Fd;

constexpr mode_t readable_by_group = 0640;

[[noreturn]] void fail(const std::filesystem::path& path, std::string_view what) {
  throw std::system_error(errno, std::generic_category(),
                          fmt::format("{} cannot be {}", path.string(), what));
}

Fd open_or_fail(const std::filesystem::path& path, int flags, std::string_view what) {
  Fd opened(::open(path.c_str(), flags | O_CLOEXEC, readable_by_group));
  if (!opened) {
    fail(path, what);
  }
  return opened;
}

std::filesystem::path new_name_of(const std::filesystem::path& file) {
  return file.string() + ".new";
}

}  // namespace

Fd lock_folder(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "lock";
  Fd lock = open_or_fail(path, O_RDWR | O_CREAT, "opened");
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) {
      throw std::runtime_error(fmt::format(
          "the journal folder {} is in use by another gateway; end it or choose another "
          "folder",
          folder.string()));
    }
    fail(path, "locked");
  }
  return lock;
}

std::string read_file(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) {
    return {};
  }
  const Fd in = open_or_fail(file, O_RDONLY, "opened");
  std::string bytes;
  constexpr std::size_t chunk = 65'536;
  while (true) {
    const std::size_t before = bytes.size();
    bytes.resize(before + chunk);
    const ssize_t got = ::read(in.get(), bytes.data() + before, chunk);
    if (got < 0) {
      fail(file, "read");
    }
    bytes.resize(before + static_cast<std::size_t>(got));
    if (got == 0) {
      return bytes;
    }
  }
}

void write_all(const Fd& file, std::string_view bytes, const std::filesystem::path& name) {
  while (!bytes.empty()) {
    const ssize_t put = ::write(file.get(), bytes.data(), bytes.size());
    if (put < 0 && errno != EINTR) {
      fail(name, "written");
    }
    bytes.remove_prefix(put < 0 ? 0 : static_cast<std::size_t>(put));
  }
}

void force(const Fd& file, const std::filesystem::path& name) {
  if (::fdatasync(file.get()) != 0) {
    fail(name, "forced to the disk");
  }
}

Fd begin_new_file(const std::filesystem::path& file, std::string_view bytes) {
  const std::filesystem::path name = new_name_of(file);
  Fd new_file = open_or_fail(name, O_WRONLY | O_APPEND | O_CREAT | O_TRUNC, "opened");
  write_all(new_file, bytes, name);
  return new_file;
}

void replace_file(const Fd& new_file, const std::filesystem::path& file) {
  const std::filesystem::path name = new_name_of(file);
  force(new_file, name);
  std::filesystem::rename(name, file);
  const std::filesystem::path parent = file.parent_path();
  const Fd folder = open_or_fail(parent, O_RDONLY | O_DIRECTORY, "opened");
  if (::fsync(folder.get()) != 0) {
    fail(parent, "forced to the disk");
  }
}

}  // namespace millrace::gateway::journal
