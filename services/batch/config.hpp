// Reads and checks batch.textproto (schema and defaults: idl/batch.proto).
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "services/sdk/announcement.hpp"

namespace millrace::services::batch {

// One script of the batch service, as configured and checked.

enum class TooLong : std::uint8_t { refuse, cut };
enum class Encoding : std::uint8_t { utf8, cp1252 };

struct Script {
  sdk::Announcement announcement{.delivery = fabric::Delivery::at_most_once};
  /// Absolute.
  std::filesystem::path program;
  /// The arguments before the request.
  std::vector<std::string> arguments;
  /// Absolute.
  std::filesystem::path folder;
  std::chrono::milliseconds time_limit{30000};
  TooLong too_long = TooLong::refuse;
  Encoding encoding = Encoding::utf8;
  bool accept_empty = false;
  bool operator==(const Script&) const = default;
};

struct Config {
  /// A change of file or program applies after this time without another.
  std::chrono::milliseconds settle{500};
  std::vector<Script> scripts;
};

/// The error has one line per mistake, with file, line and column. A missing script file is not a
/// mistake: it may be added later.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

}  // namespace millrace::services::batch
