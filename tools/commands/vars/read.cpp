// millrace vars MACHINE read: values of variables.
#include "base/program/command_line.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/vars/vars.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;

struct ReadOptions : VarsOptions {
  ReadOptions(CLI::App& command, Machine the_machine)
      : VarsOptions(command, std::move(the_machine)), output(command) {}
  ListingFlags output;
  std::vector<std::string> names;
};

int read_all(const ReadOptions& options, Source& source) {
  std::vector<Reading> readings;
  for (auto& reading : source.read(options.names)) {
    if (reading) {
      readings.push_back(std::move(*reading));
    } else {
      print_failure(options, reading.error());
    }
  }
  if (!readings.empty() || !options.output.is_text()) {
    print_listing(readings_listing(), readings, options.output);
  }
  return readings.size() == options.names.size() ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_read(CLI::App& vars, const Machine& machine, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(vars, "read", "Read the values of variables",
                     "millrace vars cnc read V.G.SERVICE.UUID 'V.E.TABLE[1]' V.A.ABS.X");
  auto options = std::make_shared<ReadOptions>(command, machine);
  command
      .add_option(
          "NAME", options->names,
          "A variable, as an NC program writes it; an array is read as a whole without index. "
          "Through a gateway also an object: block_number, mc_active_feed_override_r")
      ->required();
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    return with_source(wanted, [&](Source& source) { return read_all(wanted, source); });
  });
}

}  // namespace millrace::tools::commands::vars
