// millrace programs: starts, ends and aborts of the NC programs of machines.
#include "tools/commands/data/data.hpp"
#include "tools/commands/data/listen.hpp"
#include "tools/commands/data/listings.hpp"

namespace millrace::tools::commands::data {

namespace {

int show_programs(const DataOptions& options) {
  const auto wanted = [&](const recording::Entry& entry) {
    const auto* event = std::get_if<fabric::ProgramEvent>(&entry.sample);
    return event != nullptr && options.takes(event->key);
  };
  if (options.follows) {
    return follow(options, wanted);
  }
  const auto [events, machines] = receive(options, wanted);
  return options.show(programs_listing(), events, machines,
                      "no gateway on fabric '{}', domain {}, has published an NC program; programs "
                      "{{ }} in its configuration lists the channels that it watches");
}

}  // namespace

void add_programs(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "programs",
      "Starts, ends and aborts of NC programs: the last event of each channel, or all as they come",
      "millrace programs press -f");
  auto options = std::make_shared<DataOptions>(command, "event");
  run_if_chosen(command, chosen, options, show_programs);
}

}  // namespace millrace::tools::commands::data
