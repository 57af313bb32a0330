// millrace-batch: programs and scripts as services.
#include <algorithm>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "base/program/log.hpp"
#include "fabric/profile/command_line.hpp"
#include "services/batch/folder.hpp"
#include "services/batch/one_script.hpp"
#include "services/sdk/stop_signals.hpp"

namespace {

using namespace millrace;
namespace program = base::program;
namespace batch = services::batch;

/// --config: many programs, each with its UUID.
int serve_folder(int argc, char** argv) {
  CLI::App app{
      "Answers calls with programs and scripts.\n"
      "For one program without a file: millrace-batch --exec ./script (see --exec --help)"};
  std::string file = "batch.textproto";
  app.add_option("--config", file, "What to serve; changes are followed")->capture_default_str();
  auto level = spdlog::level::info;
  program::add_log_level(app, level);
  const fabric::profile::FabricFlags fabric(app);
  return program::run(app, argc, argv, [&] {
    const fabric::dds::ParticipantOptions join = fabric.options();
    const auto log = program::make_log("batch", level);
    const services::sdk::ServiceOptions options{.version = MILLRACE_VERSION,
                                                .domain = join.domain,
                                                .fabric = join.fabric,
                                                .lease = join.lease,
                                                .configuration = join.configuration};
    std::optional<batch::Folder> folder;
    services::sdk::StopSignals signals(log);
    folder.emplace(file, options, log);
    signals.on_stop([&] { folder->stop(); });
    program::ready(
        fmt::format("batch serves {} UUIDs of {} on domain {}", folder->size(), file, join.domain));
    folder->follow();
    return program::exit_done;
  });
}

bool is_exec(std::string_view argument) {
  return argument == "--exec" || argument.starts_with("--exec=");
}

}  // namespace

int main(int argc, char** argv) {
  return std::any_of(argv, argv + argc, is_exec) ? batch::serve_one(argc, argv)
                                                 : serve_folder(argc, argv);
}
