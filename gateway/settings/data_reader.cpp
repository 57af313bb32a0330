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
    const config::Data& one = from.data(i);
    expect_served(from, one.channel(), path / ConfigStep{"data", i} / "channel", mistakes);
    to.groups.push_back({.name = one.name(),
                         .channel = static_cast<std::uint16_t>(one.channel()),
                         .names = {one.variable().begin(), one.variable().end()},
                         .period = std::chrono::milliseconds(one.period_ms()),
                         .deadband = one.deadband(),
                         .always = one.always()});
  }
  return to;
}

std::vector<programs::ProgramSettings> read_programs(const config::Machine& from,
                                                     const ConfigPath& path, Mistakes& mistakes) {
  std::vector<programs::ProgramSettings> all;
  for (int i = 0; i < from.programs_size(); ++i) {
    const config::Programs& one = from.programs(i);
    expect_served(from, one.channel(), path / ConfigStep{"programs", i} / "channel", mistakes);
    all.push_back({.channel = static_cast<std::uint16_t>(one.channel()),
                   .period = std::chrono::milliseconds(one.period_ms()),
                   .name = one.name(),
                   .error = one.error(),
                   .counter = one.counter()});
  }
  return all;
}

variables::VariableSettings read_variables(const config::Machine& from, const ConfigPath& path,
                                           Mistakes& mistakes) {
  variables::VariableSettings to;
  to.requests_per_second = from.variable_requests_per_second();
  for (int i = 0; i < from.variables_size(); ++i) {
    const config::Variables& one = from.variables(i);
    const ConfigPath place = path / ConfigStep{"variables", i};
    const std::vector<std::uint16_t> channels(one.channel().begin(), one.channel().end());
    for (int c = 0; c < one.channel_size(); ++c) {
      expect_served(from, one.channel(c), place / ConfigStep{"channel", c}, mistakes);
    }
    for (int w = 0; w < one.write_size(); ++w) {
      const std::string wrong = variables::wrong_pattern(one.write(w));
      mistakes.expect(wrong.empty(), place / ConfigStep{"write", w}, wrong);
      to.writable.push_back({one.write(w), channels});
    }
  }
  return to;
}

}  // namespace millrace::gateway::settings
