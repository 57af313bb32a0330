#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "gateway/settings/readers.hpp"

namespace millrace::gateway::settings {

namespace {

using base::configuration::ConfigPath;
using base::configuration::ConfigStep;
using data::DataSettings;
using data::GroupSettings;

constexpr int most_groups = 64;
constexpr int most_variables = 256;
constexpr int most_rules = 64;
constexpr std::uint32_t shortest_ms = 10;
constexpr std::uint32_t longest_ms = 3'600'000;

bool is_control(char c) {
  return static_cast<unsigned char>(c) < ' ';
}

}  // namespace

std::string wrong_variable(const std::string& name) {
  // The value of a group's sample names it, and so does a question to the controller.
  constexpr std::size_t longest = 255;
  if (name.empty()) {
    return "is empty; expected a variable as programs write it, or an object: \"V.A.ACT_POS.X\"";
  }
  if (name.size() > longest) {
    return fmt::format("has {} characters; expected at most {}", name.size(), longest);
  }
  if (std::ranges::any_of(name, is_control)) {
    return "contains a control character; expected a name as programs write it";
  }
  return {};
}

DataSettings DataReader::read(const config::Machine& from, const ConfigPath& path) {
  constexpr std::uint32_t most_requests = 1000;
  DataSettings to;
  mistakes_.expect_range(from.data_requests_per_second(), 1U, most_requests,
                         path / "data_requests_per_second");
  to.requests_per_second = from.data_requests_per_second();
  mistakes_.expect(from.data_size() <= most_groups, path / ConfigStep{"data", most_groups},
                   fmt::format("machine {} has {} data groups; expected at most {}", from.name(),
                               from.data_size(), most_groups));
  std::set<std::pair<std::uint32_t, std::string>> names;
  for (int i = 0; i < from.data_size() && i < most_groups; ++i) {
    const ConfigPath place = path / ConfigStep{"data", i};
    const config::Data& one = from.data(i);
    to.groups.push_back(group(from, one, place));
    mistakes_.expect(
        one.name().empty() || names.insert({one.channel(), one.name()}).second, place / "name",
        fmt::format("two groups of channel {} are called \"{}\"; expected different names",
                    one.channel(), one.name()));
  }
  return to;
}

GroupSettings DataReader::group(const config::Machine& machine, const config::Data& from,
                                const ConfigPath& path) {
  check_name(from.name(), path / "name");
  check_channel(machine, from.channel(), path / "channel");
  mistakes_.expect_range(from.period_ms(), shortest_ms, longest_ms, path / "period_ms");
  mistakes_.expect(std::isfinite(from.deadband()) && from.deadband() >= 0, path / "deadband",
                   fmt::format("{}; expected 0 or a positive number", from.deadband()));
  const bool some = from.variable_size() > 0 && from.variable_size() <= most_variables;
  mistakes_.expect(some, path,
                   fmt::format("the group has {} variables; expected 1 to {}", from.variable_size(),
                               most_variables));
  GroupSettings to;
  to.name = from.name();
  to.channel = static_cast<std::uint16_t>(from.channel());
  to.period = std::chrono::milliseconds(from.period_ms());
  to.deadband = from.deadband();
  to.always = from.always();
  std::set<std::string> seen;
  for (int i = 0; i < from.variable_size() && i < most_variables; ++i) {
    const std::string& name = from.variable(i);
    const std::string wrong = wrong_variable(name);
    const ConfigPath place = path / ConfigStep{"variable", i};
    if (mistakes_.expect(wrong.empty(), place, wrong)) {
      mistakes_.expect(seen.insert(name).second, place,
                       fmt::format("\"{}\" is named twice in this group", name));
    }
    to.names.push_back(name);
  }
  return to;
}

std::vector<programs::ProgramSettings> DataReader::read_programs(const config::Machine& from,
                                                                 const ConfigPath& path) {
  std::vector<programs::ProgramSettings> all;
  std::set<std::uint32_t> channels;
  for (int i = 0; i < from.programs_size(); ++i) {
    const config::Programs& one = from.programs(i);
    const ConfigPath place = path / ConfigStep{"programs", i};
    check_channel(from, one.channel(), place / "channel");
    mistakes_.expect(channels.insert(one.channel()).second, place,
                     fmt::format("programs of channel {} are watched twice", one.channel()));
    mistakes_.expect_range(one.period_ms(), shortest_ms, longest_ms, place / "period_ms");
    const auto source = [&](bool is_there, const std::string& name, const std::string& field) {
      const std::string wrong = is_there ? wrong_variable(name) : std::string();
      mistakes_.expect(wrong.empty(), place / field, wrong);
      return name;
    };
    all.push_back({.channel = static_cast<std::uint16_t>(one.channel()),
                   .period = std::chrono::milliseconds(one.period_ms()),
                   .name = source(one.has_name(), one.name(), "name"),
                   .error = source(one.has_error(), one.error(), "error"),
                   .counter = source(one.has_counter(), one.counter(), "counter")});
  }
  return all;
}

variables::VariableSettings DataReader::read_variables(const config::Machine& from,
                                                       const ConfigPath& path) {
  constexpr std::uint32_t most_requests = 10'000;
  variables::VariableSettings to;
  mistakes_.expect_range(from.variable_requests_per_second(), 1U, most_requests,
                         path / "variable_requests_per_second");
  to.requests_per_second = from.variable_requests_per_second();
  mistakes_.expect(from.variables_size() <= most_rules, path / ConfigStep{"variables", most_rules},
                   fmt::format("machine {} has {} rules about variables; expected at most {}",
                               from.name(), from.variables_size(), most_rules));
  for (int i = 0; i < from.variables_size() && i < most_rules; ++i) {
    const config::Variables& one = from.variables(i);
    const ConfigPath place = path / ConfigStep{"variables", i};
    mistakes_.expect(one.write_size() > 0, place,
                     "it lists no writable variable; expected write: \"V.E.*\"");
    std::vector<std::uint16_t> channels;
    for (int c = 0; c < one.channel_size(); ++c) {
      check_channel(from, one.channel(c), place / ConfigStep{"channel", c});
      channels.push_back(static_cast<std::uint16_t>(one.channel(c)));
    }
    for (int w = 0; w < one.write_size(); ++w) {
      const std::string wrong = variables::wrong_pattern(one.write(w));
      mistakes_.expect(wrong.empty(), place / ConfigStep{"write", w}, wrong);
      to.writable.push_back({one.write(w), channels});
    }
  }
  return to;
}

void DataReader::check_channel(const config::Machine& machine, std::uint32_t channel,
                               const ConfigPath& path) {
  constexpr std::uint32_t last_channel = 255;
  if (mistakes_.expect_range(channel, 1U, last_channel, path)) {
    const bool served = machine.channel_size() == 0 ||
                        std::ranges::find(machine.channel(), channel) != machine.channel().end();
    mistakes_.expect(
        served, path,
        fmt::format("{}; machine {} is served with other channels only", channel, machine.name()));
  }
}

void DataReader::check_name(const std::string& name, const ConfigPath& path) {
  mistakes_.expect(
      !name.empty() && name.size() <= fabric::longest_machine_name && fabric::is_machine_name(name),
      path,
      fmt::format("the name of the group \"{}\"; expected letters, digits, '_' and "
                  "'-', at most {}",
                  name, fabric::longest_machine_name));
}

}  // namespace millrace::gateway::settings
