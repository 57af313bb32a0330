// Which file it is, whatever its name.
//
//   const FileIdentity opened = identity_of(file);
//   …
//   if (identity_of(file) != opened)        // it was moved, removed or replaced
#pragma once

#include <filesystem>
#include <utility>

#include <sys/types.h>

namespace millrace::base::posix {

/// Its file system and its number there.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Zeros if there is no file, or it cannot be reached.
FileIdentity identity_of(const std::filesystem::path& file);

}  // namespace millrace::base::posix
