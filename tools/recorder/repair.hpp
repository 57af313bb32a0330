// A whole recording out of one that was cut or damaged.
#pragma once

#include <filesystem>
#include <string>

#include "tools/mcap/repair_file.hpp"

namespace millrace::tools::recorder {

/// mcap::repair_file(), and what the recorder counted is counted anew: a part of it may be gone.
/// What the bus had delivered and lost is not known any more.
tl::expected<mcap::RepairReport, std::string> repair_recording(
    const std::filesystem::path& damaged, const std::filesystem::path& repaired,
    const std::string& library);

}  // namespace millrace::tools::recorder
