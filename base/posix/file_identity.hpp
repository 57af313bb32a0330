// The identity of a file, independent of its name.
//
//   const FileIdentity opened = identity_of(file);
//   …
//   if (identity_of(file) != opened)        // it was moved, removed or replaced
#pragma once

#include <filesystem>
#include <utility>

#include <sys/types.h>

namespace millrace::base::posix {

/// Its device and its inode number there.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Zeros if the file does not exist or cannot be accessed.
FileIdentity identity_of(const std::filesystem::path& file);

}  // namespace millrace::base::posix
