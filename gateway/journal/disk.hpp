// The file operations of the journal; every failure is a std::system_error with the path.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/posix/fd.hpp"

namespace millrace::gateway::journal {

/// Opens FOLDER/lock and locks it for this process. Fails if another process has the lock.
base::posix::Fd lock_folder(const std::filesystem::path& folder);

/// The whole file; empty if there is none.
std::string read_file(const std::filesystem::path& file);

/// Writes all of it.
void write_all(const base::posix::Fd& file, std::string_view bytes,
               const std::filesystem::path& name);

/// Forces the file to the disk.
void force(const base::posix::Fd& file, const std::filesystem::path& name);

/// Begins FILE.new, which is to take the place of `file`, with these bytes; open for appending.
base::posix::Fd begin_new_file(const std::filesystem::path& file, std::string_view bytes);

/// Forces the new file to the disk and replaces `file` with it, atomically even if the power fails.
void replace_file(const base::posix::Fd& new_file, const std::filesystem::path& file);

}  // namespace millrace::gateway::journal
