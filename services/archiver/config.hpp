// Reads and checks archiver.textproto (schema and defaults: idl/archiver.proto).
#pragma once

#include <filesystem>
#include <set>
#include <string>

#include <tl/expected.hpp>

#include "services/archiver/archive.hpp"

namespace millrace::services::archiver {

struct Config {
  /// Absolute.
  std::filesystem::path folder;
  Policy policy;
  bool record_events = true;
  bool record_channels = true;
  bool record_data = true;
  bool record_programs = true;
  /// Canonical UUIDs whose texts are not recorded.
  std::set<std::string> without_text;
};

/// The error has one line per mistake, with file, line and column.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

/// Defaults, with the archive in the folder "archive" of `folder`.
Config default_config(const std::filesystem::path& folder);

}  // namespace millrace::services::archiver
