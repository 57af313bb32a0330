// Files and folders: durable writes, identity, locks, access beneath a folder.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <sys/types.h>
#include <tl/expected.hpp>

#include "base/posix/system.hpp"

namespace millrace::base::posix {

// Writes, removes and renames files so that a crash or a power cut leaves a whole file or none.
//
//   if (auto written = write_durably(folder / "zeros", text); !written)
//     log->error(written.error());

/// Replaces `file` by `content`: a temporary file beside it, fsync, rename, fsync of the folder. On
/// error the old file is unchanged, and the error contains the step and the reason. `mode` is that
/// of open(2) and applies from the beginning.
tl::expected<void, std::string> write_durably(const std::filesystem::path& file,
                                              std::string_view content, mode_t mode = 0640);

/// Moves `from` to `to` on the same file system durably; replaces `to`.
tl::expected<void, std::string> rename_durably(const std::filesystem::path& from,
                                               const std::filesystem::path& to);

// The identity of a file, independent of its name.
//
//   const FileIdentity opened = identity_of(file);
//   …
//   if (identity_of(file) != opened)        // it was moved, removed or replaced

/// Its device and its inode number there.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Zeros if the file does not exist or cannot be accessed.
FileIdentity identity_of(const std::filesystem::path& file);

// One writer per folder.
//
//   const Fd lock = lock_folder(folder, "archive.lock", "another archiver writes into this folder");

/// Takes the lock `name` in `folder`. It is held until the descriptor is closed; a crash releases
/// it. Throws std::runtime_error "FOLDER: TAKEN" if another process holds it.
Fd lock_folder(const std::filesystem::path& folder, const std::string& name,
               std::string_view taken);

// Opens regular files beneath a folder by untrusted names: no name leads out of the folder, through
// no link.
//
//   auto file = open_beneath(folder, "parts/message.txt", O_WRONLY | O_APPEND | O_CREAT);

/// Opens `name` in `folder` with `flags` of open(2); a new file is readable and writable for its
/// owner and readable for its group. Refuses absolute names, "..", names that begin with a dot,
/// links in between or at the end, and other kinds of files (a pipe, a device); for writing also a
/// file with several hard links. The error is the reason, without the name. Does not block.
tl::expected<Fd, std::string> open_beneath(const std::filesystem::path& folder,
                                           const std::filesystem::path& name, int flags);

/// Finds the entry for `name` in `folder` without regard to the case of ASCII letters, as in the
/// file systems of controllers. An exact match wins, otherwise the first in alphabetical order.
/// Nullopt if there is none, or for a name that open_beneath() refuses.
std::optional<std::filesystem::path> find_ignoring_case(const std::filesystem::path& folder,
                                                        const std::filesystem::path& name);

}  // namespace millrace::base::posix
