#include "cnc/simulator/configuration.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/configuration/config_file.hpp"
#include "base/program/command_line.hpp"
#include "idl/cnc.pb.h"

namespace millrace::cnc::simulator {

namespace {

using base::program::UsageError;

/// A mistake that the schema cannot tell; `where` names the field.
[[noreturn]] void refuse(const std::string& where, const std::string& what) {
  throw UsageError(fmt::format("{}: {}", where, what));
}

template <typename Number>
void check_range(const std::string& where, Number value, Number lowest, Number highest) {
  if (!(value >= lowest && value <= highest)) {
    refuse(where, fmt::format("{}; expected {} to {}", value, lowest, highest));
  }
}

AxisSettings axis(const config::CncAxis& from, const std::string& where) {
  const auto is_letter_or_digit = [](unsigned char c) { return std::isalnum(c) != 0; };
  const std::string& name = from.name();
  if (name.empty() || std::isupper(static_cast<unsigned char>(name.front())) == 0 ||
      !std::all_of(name.begin(), name.end(), is_letter_or_digit)) {
    refuse(where, fmt::format("name \"{}\"; expected a capital letter and perhaps more letters and "
                              "digits, as in X or X1",
                              name));
  }
  if (!(from.negative_limit() < from.positive_limit())) {
    refuse(where, fmt::format("axis {}: negative_limit is not below positive_limit", name));
  }
  check_range(where + ": greatest_feed", from.greatest_feed(), 0.0, 1e6);
  return {name, from.negative_limit(), from.positive_limit(), from.greatest_feed()};
}

template <typename Axes>
std::vector<AxisSettings> axes(const Axes& from, const std::string& where) {
  check_range(where, static_cast<std::size_t>(from.size()), std::size_t{0}, max_axes);
  std::vector<AxisSettings> all;
  std::set<std::string> names;
  for (const config::CncAxis& one : from) {
    all.push_back(axis(one, where));
    if (!names.insert(one.name()).second) {
      refuse(where, fmt::format("there are two axes {}", one.name()));
    }
  }
  return all;
}

Declaration external(const config::CncExternalVariable& from, const std::string& where) {
  constexpr std::size_t longest_name = 20;
  constexpr std::uint32_t most_elements = 10'000;
  constexpr std::uint32_t longest_text = 127;
  if (from.name().empty() || from.name().size() > longest_name ||
      from.name().find_first_of("[] \t\"") != std::string::npos) {
    refuse(where, fmt::format("name \"{}\"; expected 1 to {} characters without blanks and "
                              "brackets",
                              from.name(), longest_name));
  }
  check_range(where + ": characters", from.characters(), 1U, longest_text);
  check_range(where + ": array_elements", from.array_elements(), 0U, most_elements);
  const Type type{static_cast<std::uint32_t>(from.type())};
  Declaration declaration{
      "V.E." + from.name(),
      type == Type::string ? ElementType::text(from.characters()) : ElementType::number(type),
      Access{static_cast<std::uint32_t>(from.access_rights())},
      {},
      External{from.scope() == config::CncExternalVariable::GLOBAL, from.synchronisation(), 0}};
  if (from.array_elements() > 0) {
    declaration.dimensions = {from.array_elements()};
  }
  return declaration;
}

/// In each scope one behind the other (IB/tf5200_external_variables/112418187 recommends this
/// automatic layout, documented).
void assign_addresses(std::vector<Declaration>& externals) {
  std::uint32_t end_of_global = 0;
  std::uint32_t end_of_channel = 0;
  for (Declaration& declaration : externals) {
    std::uint32_t& end = declaration.external->global ? end_of_global : end_of_channel;
    declaration.external->address = std::exchange(end, end + declaration.size());
  }
}

std::vector<Declaration> externals(const config::Cnc& config, const std::string& name) {
  std::vector<Declaration> all;
  std::set<std::string> names;
  for (const auto& variable : config.external_variable()) {
    all.push_back(external(variable, name + ": external_variable"));
    if (!names.insert(variable.name()).second) {
      refuse(name + ": external_variable", fmt::format("there are two of {}", variable.name()));
    }
  }
  assign_addresses(all);
  return all;
}

void set_channels(const config::Cnc& config, const std::string& name, Settings& settings) {
  check_range(name + ": channels", config.channels(), 1U, max_channels);
  settings.channels = config.channels();
  if (config.axis_size() > 0) {
    settings.axes = axes(config.axis(), name + ": axis");
  }
  for (const config::CncChannel& channel : config.channel()) {
    check_range(name + ": channel: number", channel.number(), 1U, config.channels());
    auto own = axes(channel.axis(), fmt::format("{}: channel {}: axis", name, channel.number()));
    if (!settings.channel_axes.emplace(channel.number(), std::move(own)).second) {
      refuse(name + ": channel", fmt::format("there are two of number {}", channel.number()));
    }
  }
}

nc::ChannelOptions programs(const config::CncPrograms& from, const std::string& where) {
  constexpr std::uint32_t highest_level = 10;
  check_range(where + ": look_ahead", from.look_ahead(), 1U, 10'000U);
  check_range(where + ": decoder_budget", from.decoder_budget(), 10U, 100'000U);
  nc::ChannelOptions options;
  options.queue = from.look_ahead();
  options.withhold_last_motion = from.withhold_last_motion();
  options.messages_read_at_once = from.messages_read();
  options.optional_stop = from.optional_stop();
  options.decoder_budget = from.decoder_budget();
  options.stream_program = from.stream_program();
  for (const std::uint32_t level : from.skipped_level()) {
    check_range(where + ": skipped_level", level, 1U, highest_level);
    options.skipped_levels = static_cast<std::uint16_t>(options.skipped_levels | 1U << (level - 1));
  }
  return options;
}

std::vector<ads::NetId> routes(const config::CncConnections& from, const std::string& where) {
  std::vector<ads::NetId> all;
  for (const std::string& text : from.route()) {
    const auto net_id = ads::NetId::parse(text);
    if (!net_id) {
      refuse(where + ": route",
             fmt::format("\"{}\"; expected six numbers, as in 127.0.0.1.2.1", text));
    }
    all.push_back(*net_id);
  }
  return all;
}

ConnectionSettings connections(const config::CncConnections& from, const std::string& where) {
  check_range(where + ": delay_ms", from.delay_ms(), 0U, 60'000U);
  return {static_cast<ads::ForeignTarget>(from.foreign_target()),
          routes(from, where),
          from.one_per_address(),
          from.sum_commands(),
          from.symbols(),
          from.notifications_survive(),
          {std::chrono::milliseconds(from.delay_ms()), from.drop_every(), from.out_of_order(),
           from.segment(), from.refuse()}};
}

/// A relative folder starts at `base`.
Settings settings_of(const config::Cnc& config, const std::string& name,
                     const std::filesystem::path& base) {
  Settings settings;
  set_channels(config, name, settings);
  const auto& service = config.service_interface();
  settings.service = {service.response_clears_request(), service.ads_request_clears_response(),
                      service.reset_clears_states(), service.start_clears_states()};
  const auto& answers = config.answers();
  settings.answers = {answers.whole_string_buffer(),
                      static_cast<ads::ErrorCode>(answers.unknown_variable()), answers.old_groups(),
                      answers.old_value_offset()};
  if (answers.old_value_offset() != 92 && answers.old_value_offset() != 96) {
    refuse(name + ": answers: old_value_offset",
           fmt::format("{}; expected 92 or 96", answers.old_value_offset()));
  }
  constexpr double slowest = 1;
  constexpr double fastest = 1e6;
  settings.program = programs(config.programs(), name + ": programs");
  check_range(name + ": programs: operations_per_cycle", config.programs().operations_per_cycle(),
              100U, 1'000'000U);
  settings.decoder_operations = config.programs().operations_per_cycle();
  settings.timers_resume = config.programs().timers_resume();
  settings.quoted_reports = config.programs().quoted_reports();
  settings.report_time = config.programs().report_time();
  check_range(name + ": rapid_feed", config.rapid_feed(), slowest, fastest);
  settings.program.rapid_feed = config.rapid_feed();
  check_range(name + ": cycle_us", config.cycle_us(), 250U, 100'000U);
  settings.cycle = std::chrono::microseconds(config.cycle_us());
  settings.connections = connections(config.connections(), name + ": connections");
  settings.externals = externals(config, name);
  for (const std::string& folder : config.program_folder()) {
    settings.folders.push_back(base / folder);
  }
  return settings;
}

}  // namespace

Settings read_settings(const std::filesystem::path& file) {
  const auto config = base::configuration::read_config<config::Cnc>(file);
  if (!config) {
    throw UsageError(config.error());
  }
  return settings_of(*config, file.string(), file.parent_path());
}

Settings parse_settings(const std::string& text, const std::string& name) {
  config::Cnc config;
  if (const auto parsed = base::configuration::parse_config(text, name, config); !parsed) {
    throw UsageError(parsed.error());
  }
  return settings_of(config, name, {});
}

}  // namespace millrace::cnc::simulator
