#include "tools/commands/lint/files.hpp"

#include <array>
#include <cerrno>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include "base/posix/beneath.hpp"
#include "base/program/command_line.hpp"

namespace millrace::tools::commands::lint {

namespace {

using base::program::UsageError;

/// The parser reports files over 16 MiB.
constexpr std::size_t most_bytes = (std::size_t{16} << 20U) + 1;

/// Nothing if it cannot be read.
std::optional<std::string> read_all(int fd) {
  std::string text;
  std::array<char, 65536> part{};
  while (text.size() < most_bytes) {
    const ssize_t size = ::read(fd, part.data(), part.size());
    if (size < 0 && errno == EINTR) {
      continue;
    }
    if (size < 0) {
      return std::nullopt;
    }
    if (size == 0) {
      break;
    }
    text.append(part.data(), static_cast<std::size_t>(size));
  }
  return text;
}

std::string read_file(const std::filesystem::path& file) {
  const base::posix::Fd fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
  auto text = fd.get() < 0 ? std::nullopt : read_all(fd.get());
  if (!text) {
    throw UsageError(base::posix::last_error("cannot read " + file.string()));
  }
  return *std::move(text);
}

}  // namespace

tools::lint::Source read_program(const std::string& name) {
  if (name != "-") {
    return {name, read_file(name)};
  }
  auto text = read_all(STDIN_FILENO);
  if (!text) {
    throw UsageError(base::posix::last_error("cannot read standard input"));
  }
  return {"<stdin>", *std::move(text)};
}

std::optional<tools::lint::Source> find_program(const std::vector<std::filesystem::path>& folders,
                                                const std::string& name) {
  for (const std::filesystem::path& folder : folders) {
    const std::filesystem::path where = folder.empty() ? std::filesystem::path(".") : folder;
    const auto found = base::posix::find_ignoring_case(where, name);
    if (!found) {
      continue;
    }
    if (const auto file = base::posix::open_beneath(where, *found, O_RDONLY)) {
      if (auto text = read_all(file->get())) {
        return tools::lint::Source{(folder / *found).string(), *std::move(text)};
      }
    }
  }
  return std::nullopt;
}

std::vector<std::string> read_words(const std::filesystem::path& file) {
  std::istringstream lines(read_file(file));
  std::vector<std::string> words;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream parts(line);
    std::string word;
    if (parts >> word && !word.starts_with('#')) {
      words.push_back(std::move(word));
    }
  }
  return words;
}

}  // namespace millrace::tools::commands::lint
