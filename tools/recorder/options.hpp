// The options of a recorder.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/mcap/compression.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recorder {

/// When written data is forced to the disk.
enum class Sync : std::uint8_t {
  /// At times that the operating system chooses.
  none,
  /// With each chunk that is closed by time, and when a call failed.
  interval,
  /// Also with each call that is answered.
  call
};

/// Keep the newest entries in memory and write them after a failure.
struct Window {
  std::chrono::nanoseconds length = std::chrono::seconds(30);
  /// Everything is written for this long after a failure.
  std::chrono::nanoseconds after = std::chrono::seconds(1);
  /// Memory for it; the oldest goes first.
  std::uint64_t size = std::uint64_t{256} * 1024 * 1024;
};

/// A file that belongs to the recording.
struct AttachedFile {
  std::string name{};
  std::string media_type{};
  std::string data{};
  /// When it was read.
  fabric::Time at{};
};

struct Options {
  std::filesystem::path file{};
  recording::Filter filter{};
  /// Services whose texts are not recorded, canonical.
  std::set<std::string> without_text{};
  /// A chunk is closed, and safe from a cut, after this long.
  std::chrono::nanoseconds chunk_period = std::chrono::milliseconds(250);
  Sync sync = Sync::interval;
  mcap::Compression compression = mcap::Compression::none;
  /// A new file is begun at this size or age; 0 = never.
  std::uint64_t rotate_size = 0;
  std::chrono::nanoseconds rotate_time{};
  /// The closed files of the series (series.hpp) are removed, the oldest first, when all are larger
  /// than this, and when the disk has less than `minimum_free` left; 0 = none is removed.
  std::uint64_t keep_size = 0;
  /// Recordings named by their time are one series: what their names begin with.
  std::string prefix{};
  /// The recording ends, in order, when the disk has less space than this left.
  std::uint64_t minimum_free = std::uint64_t{100} * 1024 * 1024;
  std::optional<Window> window{};
  /// The writing program: name and version.
  std::string library{};
  /// Goes into the metadata of each file: host, fabric, …
  std::map<std::string, std::string> labels{};
  /// Go into each file as they are: the configuration of the fabric, …
  std::vector<AttachedFile> attachments{};
};

}  // namespace millrace::tools::recorder
