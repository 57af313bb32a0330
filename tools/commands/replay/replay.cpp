#include "tools/commands/replay/replay.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "tools/commands/recordings/recordings.hpp"
#include "tools/recording/reader.hpp"

namespace millrace::tools::commands::replay {

namespace {

namespace program = base::program;
using tools::replay::Plan;

void tell_skipped(const Plan& plan) {
  constexpr std::size_t most = 5;
  for (std::size_t i = 0; i < plan.skipped.size() && i < most; ++i) {
    const tools::replay::Skipped& skipped = plan.skipped[i];
    fmt::print(stderr, "millrace: call {} of {} is omitted: {}\n", skipped.recorded.to_string(),
               skipped.channel.to_string(), skipped.reason);
  }
  if (plan.skipped.size() > most) {
    fmt::print(stderr, "millrace: and {} more\n", plan.skipped.size() - most);
  }
}

int replay(const Options& options) {
  check(options);
  if (options.data) {
    return data(options);
  }
  mcap::FileSource source = recordings::open(options.file);
  tools::replay::PlanBuilder builder(options.filter);
  const auto read = recording::read_entries(
      source, {}, [&](const recording::Entry& entry) { builder.add(entry); });
  const Plan plan = builder.build({.max_gap = options.max_gap});
  tell_skipped(plan);
  if (plan.calls.empty()) {
    recordings::report(options.file, read.problems);
    throw program::UsageError(fmt::format(
        "{} has no call to replay{}; 'millrace recording cat --kind request' lists what it has",
        options.file.string(), plan.skipped.empty() ? " that passes the filters" : ""));
  }
  const int result = options.to_services  ? to_services(options, plan)
                     : options.as_service ? as_service(options, plan)
                                          : as_cnc(options, plan);
  return std::max(result, recordings::report(options.file, read.problems));
}

}  // namespace

void add_replay(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "replay",
      "Replay a recording: its calls to services, as a service, as a controller; its machine data",
      "millrace replay --to-services --verify run.mcap\n"
      "  millrace replay --as-service --channel cnc=test run.mcap\n"
      "  millrace replay --as-cnc --rate 10 run.mcap\n"
      "  millrace replay --data --channel cnc=test run.mcap");
  auto options = std::make_shared<Options>(command);
  command.callback([options, &chosen] { chosen.run = [options] { return replay(*options); }; });
}

}  // namespace millrace::tools::commands::replay
