// Makes a file that every reader opens from one that was cut or damaged.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

struct RepairReport {
  /// The saved records.
  Statistics saved;
  /// The problems, with their positions in the damaged file.
  Problems problems;
};

/// Changes the metadata of the damaged file for the repaired one: the records that they count may
/// be lost.
using Revise = std::function<void(std::vector<Metadata>&)>;

/// Writes everything that can be read from `damaged` to `repaired`, with new indexes and summary.
/// `library` is the name of the repairing program. The error is the sink's, or that the file
/// contains nothing of a recording.
tl::expected<RepairReport, std::string> repair(
    Source& damaged, Sink& repaired, const std::string& library,
    const Revise& revise = [](std::vector<Metadata>&) {});

// Repair on disk.

/// Lets `write` write the new file `repaired`, which is removed if that fails.
tl::expected<RepairReport, std::string> repair_into(
    const std::filesystem::path& repaired,
    const std::function<tl::expected<RepairReport, std::string>(Sink&)>& write);

/// The default name of a repaired file: "run.mcap" and "run.mcap.part" become "run.repaired.mcap".
std::filesystem::path repaired_name(const std::filesystem::path& damaged);

/// The same if that name exists, also from an interrupted repair: "run.repaired-2.mcap", …
std::filesystem::path free_repaired_name(const std::filesystem::path& damaged);

/// Repairs `damaged` into the new file `repaired`. The error names the file that cannot be read or
/// written; then `repaired` is removed.
tl::expected<RepairReport, std::string> repair_file(
    const std::filesystem::path& damaged, const std::filesystem::path& repaired,
    const std::string& library, const Revise& revise = [](std::vector<Metadata>&) {});

}  // namespace millrace::tools::mcap
