// Repair on disk.
#pragma once

#include <filesystem>

#include "tools/mcap/repair.hpp"

namespace millrace::tools::mcap {

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
