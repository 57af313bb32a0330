// One writer per folder.
//
//   const Fd lock = lock_folder(folder, "archive.lock", "another archiver writes into this folder");
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/posix/fd.hpp"

namespace millrace::base::posix {

/// Takes the lock `name` in `folder`. It is held until the descriptor is closed; a crash releases
/// it. Throws std::runtime_error "FOLDER: TAKEN" if another process holds it.
Fd lock_folder(const std::filesystem::path& folder, const std::string& name,
               std::string_view taken);

}  // namespace millrace::base::posix
