// Writes, removes and renames files so that a crash or a power cut leaves a whole file or none.
//
//   if (auto written = write_durably(folder / "zeros", text); !written)
//     log->error(written.error());
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <sys/types.h>
#include <tl/expected.hpp>

namespace millrace::base::posix {

/// Replaces `file` by `content`: a temporary file beside it, fsync, rename, fsync of the folder. On
/// error the old file is unchanged, and the error contains the step and the reason. `mode` is that
/// of open(2) and applies from the beginning.
tl::expected<void, std::string> write_durably(const std::filesystem::path& file,
                                              std::string_view content, mode_t mode = 0640);

/// Removes `file` durably (fsync of its folder); a missing file is not an error.
tl::expected<void, std::string> remove_durably(const std::filesystem::path& file);

/// Moves `from` to `to` on the same file system durably; replaces `to`.
tl::expected<void, std::string> rename_durably(const std::filesystem::path& from,
                                               const std::filesystem::path& to);

}  // namespace millrace::base::posix
