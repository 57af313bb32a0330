// The names of the files of one recording.
#pragma once

#include <filesystem>

namespace millrace::tools::recorder {

/// The n-th file, from 1: "run.mcap" itself if there is only one, else "run-0001.mcap", …
std::filesystem::path numbered(const std::filesystem::path& path, unsigned number, bool only_one);

}  // namespace millrace::tools::recorder
