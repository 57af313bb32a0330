// The trust section of a fabric.textproto for a process: the folder, its contents, and how the
// participant learns of revocations.
//
//   auto credentials = credentials_of(profile.trust(), "fabric.textproto");
//   options.trust = trust_of(*credentials);
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <tl/expected.hpp>

#include "fabric/dds/trust.hpp"
#include "fabric/trust/folder.hpp"

namespace millrace::config {
class Trust;
}

namespace millrace::fabric::profile {

/// Reads the folder that the profile `file` names, as of now. The error names the file in it that
/// is not as it should be, and what to do.
tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file);

/// For a participant. The list of revoked participants is read again when its file is another one.
std::shared_ptr<const dds::Trust> trust_of(const trust::Credentials& credentials);

}  // namespace millrace::fabric::profile
