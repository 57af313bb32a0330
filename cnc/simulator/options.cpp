#include "cnc/simulator/options.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/program/log.hpp"
#include "base/text/ascii.hpp"
#include "cnc/simulator/configuration.hpp"

namespace millrace::cnc::simulator {

namespace {

using base::program::UsageError;
using base::text::parse_number;

ListenAddress listen_address(const std::string& text) {
  const auto address = ListenAddress::parse(text);
  if (!address) {
    throw UsageError(
        fmt::format("--listen {}: expected ADDRESS:PORT, as in 127.0.0.1:48898", text));
  }
  return *address;
}

ads::NetId parse_net_id(const std::string& text) {
  const auto net_id = ads::NetId::parse(text);
  if (!net_id) {
    throw UsageError(fmt::format("--net-id {}: expected six numbers, as in 127.0.0.1.1.1", text));
  }
  return *net_id;
}

Run parse_run(const std::string& text, std::uint32_t channels) {
  const std::size_t equals = text.find('=');
  const auto channel = parse_number<std::uint32_t>(std::string_view(text).substr(0, equals));
  if (equals == std::string::npos || !channel) {
    throw UsageError(fmt::format("--run {}: expected CHANNEL=FILE, as in 1=demo.nc", text));
  }
  if (*channel < 1 || *channel > channels) {
    throw UsageError(fmt::format("--run {}: there is no channel {}; this CNC has {} (--channels)",
                                 text, *channel, channels));
  }
  return {*channel, text.substr(equals + 1)};
}

std::vector<Run> parse_runs(const std::vector<std::string>& texts, std::uint32_t channels) {
  std::vector<Run> runs;
  for (const std::string& text : texts) {
    runs.push_back(parse_run(text, channels));
    const auto same = std::count_if(runs.begin(), runs.end(), [&](const Run& run) {
      return run.channel == runs.back().channel;
    });
    if (same > 1) {
      throw UsageError(
          fmt::format("--run {}: channel {} has a program already", text, runs.back().channel));
    }
  }
  return runs;
}

}  // namespace

void add_options(CLI::App& app, Options& options) {
  app.add_option("--listen", options.listen, "Address and TCP port of the ADS server; port 0 = any")
      ->capture_default_str();
  app.add_option("--net-id", options.net_id, "AMS NetId of this CNC")->capture_default_str();
  app.add_option("--channels", options.channels, "Number of channels; overrides the configuration")
      ->check(CLI::Range(1U, max_channels));
  app.add_option("--run", options.run, "An NC program to run; may be repeated")
      ->type_name("CHANNEL=FILE")
      ->allow_extra_args(false);
  app.add_flag("--exit-when-idle", options.exit_when_idle,
               "End when every NC program has ended; exit code 0 if all reached M30 or M02");
  app.add_option("--dir", options.folder,
                 "Folder of message.txt, and where NC programs and subprograms are searched first")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->capture_default_str();
  app.add_option("--speed", options.speed,
                 "Speed of simulated motion and dwell: 1 = real time, 10 = ten times as fast, 0 = "
                 "without waiting")
      ->check(base::program::non_negative_number());
  app.add_option("--config", options.config, "Configuration file (cnc.textproto)")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  app.add_option("--check", options.check,
                 "Only print every mistake of these NC programs; exit code 1 if there is any")
      ->type_name("FILE")
      ->check(CLI::ExistingFile);
  app.add_flag("--timings", options.timings,
               "Print at the end how long each service call took for its NC program");
  base::program::add_log_level(app, options.log_level);
}

Setup resolve(const Options& options) {
  Setup setup;
  setup.listen = listen_address(options.listen);
  setup.net_id = parse_net_id(options.net_id);
  if (!options.config.empty()) {
    setup.settings = read_settings(options.config);
  }
  setup.settings.channels = options.channels.value_or(setup.settings.channels);
  if (options.speed) {
    constexpr double slowest = 0.001;
    if (*options.speed != 0 && *options.speed < slowest) {
      throw UsageError(
          fmt::format("--speed {}: expected 0 or at least {}", *options.speed, slowest));
    }
    setup.settings.program.time_scale = *options.speed == 0 ? 0 : 1 / *options.speed;
  }
  setup.runs = parse_runs(options.run, setup.settings.channels);
  auto& folders = setup.settings.folders;
  folders.insert(folders.begin(), options.folder);
  for (const Run& run : setup.runs) {
    folders.push_back(run.file.has_parent_path() ? run.file.parent_path() : ".");
  }
  if (options.exit_when_idle && setup.runs.empty()) {
    throw UsageError("--exit-when-idle: no program is run; add --run CHANNEL=FILE");
  }
  return setup;
}

}  // namespace millrace::cnc::simulator
