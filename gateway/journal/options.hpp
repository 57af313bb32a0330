// How a journal is stored in a file.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace millrace::gateway::journal {

/// When entries are forced to the disk. A crash of the gateway loses nothing under any of them;
/// they differ in what a power cut may take.
enum class Sync : std::uint8_t {
  /// At times that the operating system chooses: the entries of the last half minute may be lost.
  never,
  /// Once a second: the entries of that second may be lost.
  interval,
  /// Before each next step: none are lost, for two waits for the disk in each call.
  always,
};

struct FileOptions {
  std::filesystem::path folder;
  Sync sync = Sync::interval;
  /// How often `interval` forces to the disk, and how often a full disk is tried again.
  std::chrono::milliseconds period{1000};
  /// A longer file is rewritten with open calls only, once it has several times the length that
  /// these need.
  std::size_t compact_at = std::size_t{1} << 20U;
  bool operator==(const FileOptions&) const = default;
};

}  // namespace millrace::gateway::journal
