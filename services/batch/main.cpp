// millrace-batch: programs and scripts as services.
#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "base/program/log.hpp"
#include "fabric/profile/command_line.hpp"
#include "services/batch/catalog.hpp"
#include "services/batch/folder.hpp"
#include "services/batch/host.hpp"
#include "services/sdk/shared_participant.hpp"
#include "services/sdk/stop_signals.hpp"

namespace {

using namespace millrace;
namespace program = base::program;
namespace batch = services::batch;

/// --config: many scripts, each with its UUID.
int serve_folder(int argc, char** argv) {
  CLI::App app{"Answers calls with programs and scripts"};
  std::string file = "batch.textproto";
  app.add_option("--config", file, "Services and their programs; changes are applied at once")
      ->capture_default_str();
  program::add_check(app);
  std::string name = "batch";
  app.add_option("--name", name,
                 "Name of this process in logs; the programs that it serves have their own")
      ->capture_default_str();
  auto level = spdlog::level::info;
  program::add_log_level(app, level);
  const fabric::profile::FabricFlags fabric(app);
  batch::tell_flags_of_one(app);
  app.footer(
      "One program without a file:\n"
      "  millrace-batch --exec ./measure.sh --uuid 1b671a64-40d5-491e-99b0-da01ff1f3341");
  return program::run(app, argc, argv, [&] {
    const fabric::dds::ParticipantOptions join = fabric.options();
    const auto log = program::make_log(name, level);
    // One process is one participant, independent of the number of scripts that it serves.
    const services::sdk::ServiceOptions options{
        .version = MILLRACE_VERSION,
        .participant = std::make_shared<services::sdk::SharedParticipant>(join, log),
        .domain = join.domain,
        .fabric = join.fabric,
        .lease = join.lease,
        .configuration = join.configuration,
        .trust = join.trust};
    std::optional<batch::Folder> folder;
    services::sdk::StopSignals signals(log);
    folder.emplace(file, options, log);
    signals.on_stop([&] { folder->stop(); });
    program::ready(fmt::format("{} serves {} {} of {} on domain {}", name, folder->size(),
                               folder->size() == 1 ? "UUID" : "UUIDs", file, join.domain));
    folder->follow();
    return program::exit_done;
  });
}

/// A missing program is no mistake: the service starts without it, and the check may run on
/// another host.
std::string checked(const std::string& file) {
  const auto config = batch::load(file);
  if (!config) {
    throw program::UsageError(config.error());
  }
  const std::size_t count = config->scripts.size();
  const std::vector<batch::Script> absent = batch::absent(config->scripts);
  for (const batch::Script& script : absent) {
    fmt::print(stderr, "warning: {}: {}\n", file, batch::absence_of(script));
  }
  return fmt::format("{} {}{}", count, count == 1 ? "program" : "programs",
                     absent.empty() ? "" : fmt::format(", {} not usable here", absent.size()));
}

bool is_exec(std::string_view argument) {
  return argument == "--exec" || argument.starts_with("--exec=");
}

bool asks_for_help(std::string_view argument) {
  return argument == "--help" || argument == "-h";
}

}  // namespace

int main(int argc, char** argv) {
  if (std::none_of(argv, argv + argc, is_exec)) {
    return program::asks_for_check(argc, argv) ? program::check(argc, argv, checked)
                                               : serve_folder(argc, argv);
  }
  // "--exec --help" has no script; it only requests the help.
  char* const* const help = std::find_if(argv, argv + argc, asks_for_help);
  if (help == argv + argc) {
    return batch::serve_one(argc, argv);
  }
  std::array<char*, 3> only_help{argv[0], *help, nullptr};
  return batch::serve_one(2, only_help.data());
}
