// The configuration of a machine's data, NC programs, variables and queues, checked.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/configuration/mistakes.hpp"
#include "cnc/ads/security.hpp"
#include "gateway/data/group.hpp"
#include "gateway/programs/program_watch.hpp"
#include "gateway/queues/queue_settings.hpp"
#include "gateway/variables/write_rules.hpp"
#include "idl/gateway.pb.h"

namespace millrace::gateway::settings {

// `path` leads to the machine. Noted is what the options of the schema cannot detect.

data::DataSettings read_data(const config::Machine& from,
                             const base::configuration::ConfigPath& path,
                             base::configuration::Mistakes& mistakes);
std::vector<programs::ProgramSettings> read_programs(const config::Machine& from,
                                                     const base::configuration::ConfigPath& path,
                                                     base::configuration::Mistakes& mistakes);
variables::VariableSettings read_variables(const config::Machine& from,
                                           const base::configuration::ConfigPath& path,
                                           base::configuration::Mistakes& mistakes);
std::vector<queues::QueueSettings> read_queues(const config::Machine& from,
                                               const base::configuration::ConfigPath& path,
                                               base::configuration::Mistakes& mistakes);

/// Expects that the gateway serves this channel of the machine; `path` leads to its number.
void expect_served(const config::Machine& machine, std::uint32_t channel,
                   const base::configuration::ConfigPath& path,
                   base::configuration::Mistakes& mistakes);

// Reads the Secure ADS settings of a machine from the configuration, and the files that it names:
// keys, certificates, passwords. A reload of the configuration reads them again.

/// Nothing for plain ADS, or if something is wrong. A relative path starts at `folder`, one with
/// $CREDENTIALS_DIRECTORY where systemd puts the credentials of a unit.
std::optional<cnc::ads::Security> read_security(const config::Machine& from,
                                                const std::filesystem::path& folder,
                                                const base::configuration::ConfigPath& path,
                                                base::configuration::Mistakes& mistakes);

}  // namespace millrace::gateway::settings
