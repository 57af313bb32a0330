// A complete recording from one that was cut or damaged.
#pragma once

#include <filesystem>
#include <string>

#include "tools/mcap/repair_file.hpp"

namespace millrace::tools::recorder {

/// mcap::repair_file(), with the recorder's counts counted again: some may be lost. The counts of
/// received and lost samples are unknown.
tl::expected<mcap::RepairReport, std::string> repair_recording(
    const std::filesystem::path& damaged, const std::filesystem::path& repaired,
    const std::string& library);

}  // namespace millrace::tools::recorder
