// Plain files beneath a folder, for names that come from elsewhere: none leads out of it, whatever
// links there are.
//
//   auto file = open_beneath(folder, "parts/message.txt", O_WRONLY | O_APPEND | O_CREAT);
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "base/posix/fd.hpp"

namespace millrace::base::posix {

/// Opens `name` in `folder` with `flags` of open(2); a new file can be read and written by its
/// owner and read by his group. Refused are absolute names, "..", names that begin with a dot,
/// links in between or at the end, and whatever is no plain file (a pipe, a device); for writing
/// also a file of more than one name. The error says why, without the name. Does not wait.
tl::expected<Fd, std::string> open_beneath(const std::filesystem::path& folder,
                                           const std::filesystem::path& name, int flags);

}  // namespace millrace::base::posix
