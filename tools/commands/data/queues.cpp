// millrace queues: the message queues of controllers, and their read positions.
#include "fabric/channel_scope.hpp"
#include "fabric/data.hpp"
#include "tools/commands/data/data.hpp"
#include "tools/commands/data/listen.hpp"
#include "tools/commands/data/listings.hpp"

namespace millrace::tools::commands::data {

namespace {

int show_queues(const DataOptions& options) {
  const auto wanted = [&](const recording::Entry& entry) {
    const auto* sample = std::get_if<fabric::DataSample>(&entry.sample);
    if (sample == nullptr || !fabric::is_queue(*sample)) {
      return false;
    }
    const std::string machine(fabric::machine_of(sample->key.machine));
    return options.takes(sample->key) || options.takes({machine, sample->key.channel});
  };
  if (options.follows) {
    return follow(options, wanted);
  }
  const auto [queues, machines] = receive(options, wanted);
  return options.show(
      queues_listing(), queues, machines,
      "no gateway on fabric '{}', domain {}, reads such a queue; queue {{ }} in the "
      "machine of its configuration lists the queues that it reads");
}

}  // namespace

void add_queues(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "queues", "Message queues of controllers, and their read positions",
                     "millrace queues press\n"
                     "  millrace queues -f --json");
  auto options = std::make_shared<DataOptions>(command, "change");
  run_if_chosen(command, chosen, options, show_queues);
}

}  // namespace millrace::tools::commands::data
