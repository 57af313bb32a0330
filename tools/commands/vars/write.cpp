// millrace vars MACHINE write: writes a variable.
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;

struct WriteOptions : VarsOptions {
  WriteOptions(CLI::App& command, Machine the_machine)
      : VarsOptions(command, std::move(the_machine)) {
    add_json(command, json);
  }
  bool json = false;
  std::string first;
  NewValue value;
};

void show(const WriteOptions& options, const Reading& before, const Reading& after) {
  if (options.json) {
    boost::json::object out = json_of(after.description);
    out["before"] = json_of(before.elements, before.is_array);
    out["value"] = json_of(after.elements, after.is_array);
    print::print_json(out);
    return;
  }
  fmt::print("{} was {}, is {}\n", base::text::safe(options.value.name),
             text_of(before.elements, before.is_array), text_of(after.elements, after.is_array));
}

int write_it(const WriteOptions& options, Source& source) {
  const auto change = source.write(options.value);
  if (!change) {
    print_failure(options, change.error());
    return program::exit_failed;
  }
  show(options, change->before, change->after);
  return program::exit_done;
}

}  // namespace

void add_write(CLI::App& vars, const Machine& machine, Chosen& chosen) {
  CLI::App& command = add_subcommand(vars, "write", "Write a variable",
                                     "millrace vars cnc write V.E.LIMIT -3.5\n"
                                     "  millrace vars cnc write V.E.TABLE 1 2 3");
  auto options = std::make_shared<WriteOptions>(command, machine);
  command.add_option("NAME", options->value.name, "A variable, as an NC program writes it")
      ->required();
  command
      .add_option("VALUE", options->first,
                  "Value in the variable's type; TRUE or FALSE; a text of at most 127 bytes; one "
                  "value for each element of an array")
      ->required();
  // As extras: an option with several values takes "[1,2]" for two of them.
  command.allow_extras();
  command.add_flag("--force", options->value.force,
                   "With --direct: also what is READ_ONLY for NC programs, and V.G.SERVICE.*");
  command.callback([options, &command, &chosen] {
    bool flags_are_over = false;
    options->value.values = {options->first};
    for (const std::string& value : command.remaining()) {
      if (!flags_are_over && value == "--") {
        flags_are_over = true;
      } else if (!flags_are_over && value.starts_with("--")) {
        throw CLI::ExtrasError(command.get_name(), {value});
      } else {
        options->value.values.push_back(value);
      }
    }
    chosen.run = [options] {
      return with_source(*options, [&](Source& source) { return write_it(*options, source); });
    };
  });
}

}  // namespace millrace::tools::commands::vars
