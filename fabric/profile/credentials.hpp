// The trust section of a fabric.textproto for a process: the folder, its contents, and how the
// participant learns of revocations.
//
//   auto credentials = credentials_of(profile.trust(), "fabric.textproto");
//   options.trust = trust_of(*credentials);
//
// One fabric.textproto serves a whole host: $CREDENTIALS_DIRECTORY is the folder that systemd gives
// a unit, and for a program started by hand the one that install-trust made for its user.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include <sys/types.h>
#include <tl/expected.hpp>

#include "fabric/dds/trust_watch.hpp"
#include "fabric/trust/folder.hpp"

namespace millrace::config {
class Trust;
}

namespace millrace::fabric::profile {

/// Where deploy/install-trust stores the credentials of a host's units and users.
inline constexpr const char* host_trust = "/etc/millrace/trust";

/// The folder in `trust` that belongs to this user, except those of units (millrace-…). If root
/// has none, the only one of another user. The error says that there is none, or names several.
tl::expected<std::filesystem::path, std::string> credentials_of_user(
    const std::filesystem::path& trust, uid_t user);

/// Reads the folder that the profile `file` names, with the present time. The error names the wrong
/// file in it, and the remedy.
tl::expected<trust::Credentials, std::string> credentials_of(const config::Trust& trust,
                                                             const std::filesystem::path& file);

/// For a participant. The CRL is read again when its file has changed.
std::shared_ptr<const dds::Trust> trust_of(const trust::Credentials& credentials);

}  // namespace millrace::fabric::profile
