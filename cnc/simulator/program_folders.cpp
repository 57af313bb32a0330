#include "cnc/simulator/program_folders.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

#include <fmt/format.h>

namespace millrace::cnc::simulator {

namespace fs = std::filesystem;

tl::expected<Program, std::string> read_program(const fs::path& file) {
  if (fs::is_directory(file)) {
    return tl::unexpected(fmt::format("{} cannot be read: it is a folder", file.string()));
  }
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return tl::unexpected(
        fmt::format("{} cannot be read: {}", file.string(), std::strerror(errno)));
  }
  std::ostringstream text;
  text << in.rdbuf();
  return Program{file.string(), text.str()};
}

ProgramFolders::ProgramFolders(std::vector<fs::path> folders) : folders_(std::move(folders)) {}

tl::expected<Program, std::string> ProgramFolders::load(std::string_view name) {
  std::string searched;
  for (const fs::path& folder : folders_) {
    const fs::path file = folder / name;
    std::error_code unreadable;
    if (fs::is_regular_file(file, unreadable)) {
      return read_program(file);
    }
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  return tl::unexpected(fmt::format("program {} is in none of the folders {}", name, searched));
}

}  // namespace millrace::cnc::simulator
