#include <algorithm>

#include <fmt/format.h>

#include "gateway/settings/readers.hpp"

namespace millrace::gateway::settings {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using base::configuration::Mistakes;

void expect_served(const config::Machine& machine, std::uint32_t channel, const ConfigPath& path,
                   Mistakes& mistakes) {
  const bool served = machine.channel_size() == 0 ||
                      std::ranges::find(machine.channel(), channel) != machine.channel().end();
  mistakes.expect(
      served, path,
      fmt::format("{}; machine {} is served with other channels only", channel, machine.name()));
}

data::DataSettings read_data(const config::Machine& from, const ConfigPath& path,
                             Mistakes& mistakes) {
  data::DataSettings to;
  to.requests_per_second = from.data_requests_per_second();
  for (int i = 0; i < from.data_size(); ++i) {
    const config::Data& group = from.data(i);
    expect_served(from, group.channel(), path / ConfigStep{"data", i} / "channel", mistakes);
    to.groups.push_back({.name = group.name(),
                         .channel = static_cast<std::uint16_t>(group.channel()),
                         .names = {group.variable().begin(), group.variable().end()},
                         .period = std::chrono::milliseconds(group.period_ms()),
                         .deadband = group.deadband(),
                         .always = group.always()});
  }
  return to;
}

std::vector<programs::ProgramSettings> read_programs(const config::Machine& from,
                                                     const ConfigPath& path, Mistakes& mistakes) {
  std::vector<programs::ProgramSettings> all;
  for (int i = 0; i < from.programs_size(); ++i) {
    const config::Programs& programs = from.programs(i);
    expect_served(from, programs.channel(), path / ConfigStep{"programs", i} / "channel", mistakes);
    all.push_back({.channel = static_cast<std::uint16_t>(programs.channel()),
                   .period = std::chrono::milliseconds(programs.period_ms()),
                   .name = programs.name(),
                   .error = programs.error(),
                   .counter = programs.counter()});
  }
  return all;
}

variables::VariableSettings read_variables(const config::Machine& from, const ConfigPath& path,
                                           Mistakes& mistakes) {
  variables::VariableSettings to;
  to.requests_per_second = from.variable_requests_per_second();
  for (int i = 0; i < from.variables_size(); ++i) {
    const config::Variables& variables = from.variables(i);
    const ConfigPath place = path / ConfigStep{"variables", i};
    const std::vector<std::uint16_t> channels(variables.channel().begin(),
                                              variables.channel().end());
    for (int c = 0; c < variables.channel_size(); ++c) {
      expect_served(from, variables.channel(c), place / ConfigStep{"channel", c}, mistakes);
    }
    for (int w = 0; w < variables.write_size(); ++w) {
      const std::string wrong = variables::wrong_pattern(variables.write(w));
      mistakes.expect(wrong.empty(), place / ConfigStep{"write", w}, wrong);
      to.writable.push_back({variables.write(w), channels});
    }
  }
  return to;
}

}  // namespace millrace::gateway::settings
