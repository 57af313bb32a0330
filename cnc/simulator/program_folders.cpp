#include "cnc/simulator/program_folders.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/posix/beneath.hpp"

namespace millrace::cnc::simulator {

namespace fs = std::filesystem;

namespace {

using base::posix::Fd;

/// The whole text of an open file with the name `file`.
tl::expected<Program, std::string> text_of(const Fd& open, const fs::path& file) {
  const auto refused = [&](const std::string& why) {
    return tl::unexpected(fmt::format("{} cannot be read: {}", file.string(), why));
  };
  struct stat status {};
  if (::fstat(open.get(), &status) != 0) {
    return refused(std::strerror(errno));
  }
  if (!S_ISREG(status.st_mode)) {
    return refused(S_ISDIR(status.st_mode) ? "it is a folder" : "it is not a regular file");
  }
  if (status.st_size > longest_program) {
    return refused(fmt::format("it has {} bytes; an NC program has at most {}", status.st_size,
                               longest_program));
  }
  Program program{file.string(), std::string(static_cast<std::size_t>(status.st_size) + 1, '\0')};
  std::size_t size = 0;
  while (size < program.text.size()) {
    const ssize_t got = ::read(open.get(), program.text.data() + size, program.text.size() - size);
    if (got == 0) {
      break;
    }
    if (got < 0 && errno != EINTR) {
      return refused(std::strerror(errno));
    }
    size += got < 0 ? 0 : static_cast<std::size_t>(got);
  }
  if (size == program.text.size()) {
    return refused("it grew while it was read");
  }
  program.text.resize(size);
  return program;
}

/// The part of an absolute name beneath the folder; any other name unchanged.
fs::path beneath(const fs::path& folder, const fs::path& name) {
  if (!name.is_absolute()) {
    return name;
  }
  const fs::path rest = name.lexically_relative(fs::absolute(folder).lexically_normal());
  return rest.empty() || *rest.begin() == ".." || *rest.begin() == "." ? name : rest;
}

}  // namespace

tl::expected<Program, std::string> read_program(const fs::path& file) {
  // A pipe or a device does not block.
  const Fd open(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!open) {
    return tl::unexpected(
        fmt::format("{} cannot be read: {}", file.string(), std::strerror(errno)));
  }
  return text_of(open, file);
}

ProgramFolders::ProgramFolders(std::vector<fs::path> folders) : folders_(std::move(folders)) {}

tl::expected<Program, std::string> ProgramFolders::load(std::string_view name) {
  std::string searched;
  for (const fs::path& folder : folders_) {
    const fs::path written = beneath(folder, name);
    const fs::path place = base::posix::find_ignoring_case(folder, written).value_or(written);
    const fs::path file = folder / place;
    const auto open = base::posix::open_beneath(folder, place, O_RDONLY);
    if (open) {
      return text_of(*open, file);
    }
    std::error_code unreadable;
    const bool is_there = fs::exists(fs::symlink_status(file, unreadable));
    searched += (searched.empty() ? "" : ", ") + folder.string() +
                (is_there ? " (" + open.error() + ")" : "");
  }
  return tl::unexpected(fmt::format("program {} is in none of the folders {}", name, searched));
}

}  // namespace millrace::cnc::simulator
