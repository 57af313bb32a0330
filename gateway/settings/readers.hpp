// The configuration of a machine's data, NC programs and variables, checked.
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

/// Notes every mistake with its place.
class DataReader {
 public:
  explicit DataReader(base::configuration::Mistakes& mistakes) : mistakes_(mistakes) {}

  /// `path` leads to the machine.
  data::DataSettings read(const config::Machine& from, const base::configuration::ConfigPath& path);
  std::vector<programs::ProgramSettings> read_programs(const config::Machine& from,
                                                       const base::configuration::ConfigPath& path);
  variables::VariableSettings read_variables(const config::Machine& from,
                                             const base::configuration::ConfigPath& path);

 private:
  data::GroupSettings group(const config::Machine& machine, const config::Data& from,
                            const base::configuration::ConfigPath& path);
  void check_channel(const config::Machine& machine, std::uint32_t channel,
                     const base::configuration::ConfigPath& path);
  void check_name(const std::string& name, const base::configuration::ConfigPath& path);

  base::configuration::Mistakes& mistakes_;
};

/// What is wrong with the name of a variable or object; empty if nothing is. Only the controller
/// knows whether it exists.
std::string wrong_variable(const std::string& name);

// The configuration of a machine's message queues, checked.

/// Notes every mistake with its place; `path` leads to the machine.
std::vector<queues::QueueSettings> read_queues(const config::Machine& from,
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
