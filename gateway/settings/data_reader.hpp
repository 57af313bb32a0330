// The configuration of a machine's data, NC programs and variables, checked.
#pragma once

#include "base/configuration/mistakes.hpp"
#include "gateway/data/groups.hpp"
#include "gateway/programs/program_watch.hpp"
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

}  // namespace millrace::gateway::settings
