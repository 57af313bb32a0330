// Plain files beneath a folder, for names that come from elsewhere: none leads out of it, whatever
// links there are.
//
//   auto file = open_beneath(folder, "parts/message.txt", O_WRONLY | O_APPEND | O_CREAT);
#pragma once

#include <filesystem>
#include <optional>
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

/// What `name` is called in `folder` where upper and lower case are the same, as in the file
/// systems of controllers: as it is if there is such a file or folder; otherwise the first by the
/// alphabet that differs in the case of ASCII letters alone. Nothing if there is none, or for a
/// name that open_beneath refuses.
std::optional<std::filesystem::path> find_ignoring_case(const std::filesystem::path& folder,
                                                        const std::filesystem::path& name);

}  // namespace millrace::base::posix
