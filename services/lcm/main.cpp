// millrace-lcm: LCM processes as services of the fabric.
#include <optional>

#include <fmt/format.h>

#include "base/program/log.hpp"
#include "fabric/profile/command_line.hpp"
#include "services/lcm/host.hpp"
#include "services/sdk/shared_participant.hpp"
#include "services/sdk/stop_signals.hpp"

namespace {

using namespace millrace;
namespace program = base::program;
namespace lcm = services::lcm;

lcm::Config configuration(const std::string& file) {
  if (file.empty()) {
    return {};
  }
  auto config = lcm::load(file);
  if (!config) {
    throw program::UsageError(config.error());
  }
  return *std::move(config);
}

std::string_view served_words(const lcm::Rules& rules) {
  return rules.any_uuid ? "any UUID that a program announces" : "the UUIDs named";
}

std::string checked(const std::string& file) {
  const lcm::Config config = configuration(file);
  return fmt::format("{}, {} services, serves {}{}", config.network.url,
                     config.rules.services.size(), served_words(config.rules),
                     config.mirror ? ", mirrors the fabric" : "");
}

int serve(int argc, char** argv) {
  CLI::App app{"Connects LCM programs to the fabric as services"};
  std::string file;
  app.add_option("--config", file,
                 "Group, programs and mirror (lcm.textproto). Without it, every program on "
                 "udpm://239.255.76.67:7667 of this host");
  program::add_check(app);
  bool mirror = false;
  app.add_flag("--mirror", mirror, "Publish calls and events of the fabric on LCM");
  std::string name = "lcm";
  app.add_option("--name", name,
                 "Name of this process in logs; the programs that it serves have their own")
      ->capture_default_str();
  auto level = spdlog::level::info;
  program::add_log_level(app, level);
  const fabric::profile::FabricFlags fabric(app);
  return program::run(app, argc, argv, [&] {
    lcm::Config config = configuration(file);
    if (mirror && !config.mirror) {
      config.mirror.emplace();
    }
    fabric::dds::ParticipantOptions join = fabric.options();
    join.name = name;
    const auto log = program::make_log(name, level);
    // Before the participant of the services: all participants of a process use the discovery of
    // the first.
    std::optional<fabric::dds::Participant> hearing;
    if (config.mirror) {
      hearing.emplace(join);
    }
    std::optional<lcm::Host> host;
    services::sdk::StopSignals signals(log);
    // One process is one participant, independent of the number of LCM processes that it serves.
    const services::sdk::ServiceOptions options{
        .version = MILLRACE_VERSION,
        .participant = std::make_shared<services::sdk::SharedParticipant>(join, log)};
    host.emplace(config, options, log);
    std::optional<lcm::MirrorThread> shown;
    if (config.mirror) {
      shown.emplace(*hearing, *config.mirror, host->socket(), log);
    }
    signals.on_stop([&] { host->stop(); });
    program::ready(fmt::format("{} serves LCM programs of {} on domain {}", name,
                               config.network.url, join.domain));
    host->run();
    return program::exit_done;
  });
}

}  // namespace

int main(int argc, char** argv) {
  return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                             : serve(argc, argv);
}
