// The files that `millrace lint` reads.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/lint/lint.hpp"

namespace millrace::tools::commands::lint {

/// A program by its name, "-" for standard input. Throws base::program::UsageError if it cannot be
/// read.
tools::lint::Source read_program(const std::string& name);

/// The first plain file of this name beneath one of the folders; nothing if there is none.
std::optional<tools::lint::Source> find_program(const std::vector<std::filesystem::path>& folders,
                                                const std::string& name);

/// The first word of each line that has one and is not a comment (#). Throws
/// base::program::UsageError if the file cannot be read.
std::vector<std::string> read_words(const std::filesystem::path& file);

}  // namespace millrace::tools::commands::lint
