// Opens regular files beneath a folder by untrusted names: no name leads out of the folder, through
// no link.
//
//   auto file = open_beneath(folder, "parts/message.txt", O_WRONLY | O_APPEND | O_CREAT);
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "base/posix/fd.hpp"

namespace millrace::base::posix {

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
