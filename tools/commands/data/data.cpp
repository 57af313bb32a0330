// millrace data: the values that gateways sample.
#include "tools/commands/data/data.hpp"

#include <algorithm>

#include "tools/commands/data/listen.hpp"
#include "tools/commands/data/listings.hpp"

namespace millrace::tools::commands::data {

namespace {

constexpr const char* no_data =
    "no gateway on fabric '{}', domain {}, publishes such data; data {{ }} in its configuration "
    "lists what it samples";

struct Options : DataOptions {
  explicit Options(CLI::App& command) : DataOptions(command, "sample") {
    command.add_option("--group", groups, "Only this group; may be repeated")
        ->allow_extra_args(false);
  }

  std::vector<std::string> groups;
};

bool is_wanted(const Options& options, const recording::Entry& entry) {
  const auto* sample = std::get_if<fabric::DataSample>(&entry.sample);
  return sample != nullptr && options.takes(sample->key) &&
         (options.groups.empty() ||
          std::ranges::find(options.groups, sample->group) != options.groups.end());
}

int show_data(const Options& options) {
  const auto wanted = [&](const auto& entry) { return is_wanted(options, entry); };
  if (options.follows) {
    return follow(options, wanted);
  }
  const auto [samples, machines] = receive(options, wanted);
  return options.output.json
             ? options.show(samples_listing(), samples, machines, no_data)
             : options.show(values_listing(), value_rows(samples), machines, no_data);
}

}  // namespace

void add_data(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "data", "Values of machines, as gateways sample them",
                     "millrace data press\n"
                     "  millrace data press --group axes -f --json | jq .values[0].value");
  auto options = std::make_shared<Options>(command);
  run_if_chosen(command, chosen, options, show_data);
}

}  // namespace millrace::tools::commands::data
