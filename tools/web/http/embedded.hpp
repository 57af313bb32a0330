// Files that the build embeds in the executable: see embed.cmake.
#pragma once

#include <span>
#include <string_view>

namespace millrace::tools::web::http {

struct EmbeddedFile {
  /// "index.html", "texts/de.js"
  std::string_view path;
  std::string_view content;
};

std::span<const EmbeddedFile> embedded_files();

}  // namespace millrace::tools::web::http
