// Reads the Secure ADS settings of a machine from the configuration, and the files that it names:
// keys, certificates, passwords. A reload of the configuration reads them again.
#pragma once

#include <filesystem>
#include <optional>

#include "base/configuration/mistakes.hpp"
#include "cnc/ads/security.hpp"
#include "idl/gateway.pb.h"

namespace millrace::gateway::settings {

/// Nothing for plain ADS, or if something is wrong. A relative path starts at `folder`, one with
/// $CREDENTIALS_DIRECTORY where systemd puts the credentials of a unit.
std::optional<cnc::ads::Security> read_security(const config::Machine& from,
                                                const std::filesystem::path& folder,
                                                const base::configuration::ConfigPath& path,
                                                base::configuration::Mistakes& mistakes);

}  // namespace millrace::gateway::settings
