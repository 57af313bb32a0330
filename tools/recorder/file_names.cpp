#include "tools/recorder/file_names.hpp"

#include <fmt/format.h>

namespace millrace::tools::recorder {

std::filesystem::path numbered(const std::filesystem::path& path, unsigned number, bool only_one) {
  if (only_one) {
    return path;
  }
  std::filesystem::path name = path;
  return name.replace_filename(
      fmt::format("{}-{:04}{}", path.stem().string(), number, path.extension().string()));
}

}  // namespace millrace::tools::recorder
