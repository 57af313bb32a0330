// A file that is there whole or not at all, also after a crash or a power cut.
//
//   if (auto written = write_durably(folder / "zeros", text); !written)
//   log->error(written.error());
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <sys/types.h>
#include <tl/expected.hpp>

namespace millrace::base::posix {

/// Replaces `file` by `content`: a temporary file beside it, fsync, rename, fsync of the folder. On
/// error the old file is as it was; the error names the step and the reason. `mode` is that of
/// open(2): who may read it, from the first moment.
tl::expected<void, std::string> write_durably(const std::filesystem::path& file,
                                              std::string_view content, mode_t mode = 0640);

/// Removes `file` for good (fsync of its folder); a missing file is no error.
tl::expected<void, std::string> remove_durably(const std::filesystem::path& file);

/// Moves `from` to `to` on the same file system, replacing it, for good.
tl::expected<void, std::string> rename_durably(const std::filesystem::path& from,
                                               const std::filesystem::path& to);

}  // namespace millrace::base::posix
