// A participant's folder: written completely or not at all, and packed for its host.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "tools/trust/certificate_authorities.hpp"

namespace millrace::tools::trust {

/// Replaces the contents of `folder` with `files`: a reader sees either the old or the new ones.
/// Only the owner can read the secret ones. The error names the file.
tl::expected<void, std::string> write_participant_folder(
    const std::filesystem::path& folder, const std::vector<CredentialFiles::File>& files);

/// Removes what an interrupted command has left in the PKI folder: unused keys.
void remove_unfinished(const std::filesystem::path& plant);

/// A tar archive (POSIX ustar) of the plain files in `folder`, below `name`/, with their modes and
/// no owner.
tl::expected<std::string, std::string> tar_of(const std::filesystem::path& folder,
                                              std::string_view name);

}  // namespace millrace::tools::trust
