// millrace vars MACHINE list: the variables of a channel.
#include "base/program/command_line.hpp"
#include "cnc/variables/names.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/vars/vars.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;
using cnc::variables::Description;

struct ListOptions : VarsOptions {
  ListOptions(CLI::App& command, Machine the_machine)
      : VarsOptions(command, std::move(the_machine)), output(command) {}
  ListingFlags output;
  std::vector<std::string> families;
};

int list_families(const ListOptions& options, Source& source) {
  std::vector<Description> all;
  int exit_code = program::exit_done;
  for (const std::string_view family : cnc::variables::families) {
    const bool wanted = options.families.empty() ||
                        std::ranges::find(options.families, family) != options.families.end();
    if (!wanted) {
      continue;
    }
    const auto found = source.list(std::string(family));
    if (!found) {
      print_failure(options, found.error());
      exit_code = program::exit_failed;
      if (found.error().error == cnc::ads::ErrorCode::none) {
        return exit_code;  // No controller responded.
      }
      continue;
    }
    all.insert(all.end(), found->begin(), found->end());
  }
  print_listing(variables_listing(), all, options.output);
  return exit_code;
}

}  // namespace

void add_list(CLI::App& vars, const Machine& machine, Chosen& chosen) {
  CLI::App& command = add_subcommand(vars, "list", "Every variable with its type and mode",
                                     "millrace vars cnc list --family V.G --family V.E");
  auto options = std::make_shared<ListOptions>(command, machine);
  command
      .add_option("--family", options->families,
                  "Only this family; may be repeated. V.CYC cannot be listed")
      ->allow_extra_args(false)
      ->check(CLI::IsMember(std::vector<std::string>(cnc::variables::families.begin(),
                                                     cnc::variables::families.end())));
  run_if_chosen(command, chosen, options, [](const auto& wanted) {
    return with_source(wanted, [&](Source& source) { return list_families(wanted, source); });
  });
}

}  // namespace millrace::tools::commands::vars
