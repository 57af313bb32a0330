// Reads and checks batch.textproto (schema and defaults: idl/batch.proto).
#pragma once

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/batch/script.hpp"

namespace millrace::services::batch {

struct Config {
  std::chrono::milliseconds settle{500};
  std::vector<Script> scripts;
};

/// The error has one line per mistake, with file, line and column. A missing script file is not a
/// mistake: it may be added later.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

}  // namespace millrace::services::batch
