// millrace vars MACHINE list: the variables of a channel.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "cnc/variables/names.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;
using cnc::variables::Description;

struct ListOptions : VarsOptions {
  using VarsOptions::VarsOptions;
  std::vector<std::string> families;
};

void show(const ListOptions& options, const std::vector<Description>& variables) {
  if (options.json) {
    boost::json::array out;
    for (const Description& variable : variables) {
      out.push_back(json_of(variable));
    }
    print::print_json(out);
    return;
  }
  print::Table table({{"NAME"}, {"TYPE"}, {"BYTES", print::Align::right}, {"MODE"}});
  for (const Description& variable : variables) {
    table.add({base::text::safe(variable.name), type_text(variable), std::to_string(variable.size),
               std::string(cnc::variables::name_of(variable.access))});
  }
  fmt::print("{}", table.text());
}

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
      continue;
    }
    all.insert(all.end(), found->begin(), found->end());
  }
  show(options, all);
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
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return with_source(*options, [&](Source& source) { return list_families(*options, source); });
    };
  });
}

}  // namespace millrace::tools::commands::vars
