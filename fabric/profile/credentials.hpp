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

#include "fabric/dds/trust_watch.hpp"
#include "fabric/trust/folder.hpp"

namespace millrace::config {
class Trust;
}

namespace millrace::fabric::profile {

/// Reads the folder that the profile `file` names, with the present time. The error names the wrong
/// file in it, and the remedy.
tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file);

/// For a participant. The CRL is read again when its file has changed.
std::shared_ptr<const dds::Trust> trust_of(const trust::Credentials& credentials);

}  // namespace millrace::fabric::profile
