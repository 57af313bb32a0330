// millrace vars MACHINE read: values of variables.
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

struct ReadOptions : VarsOptions {
  using VarsOptions::VarsOptions;
  std::vector<std::string> names;
};

void show(const ReadOptions& options, const std::vector<Reading>& readings) {
  if (options.json) {
    boost::json::array out;
    for (const Reading& reading : readings) {
      boost::json::object object = json_of(reading.description);
      object["value"] = json_of(reading.elements, reading.is_array);
      out.push_back(std::move(object));
    }
    print::print_json(out);
    return;
  }
  print::Table table({{"NAME"}, {"TYPE"}, {"MODE"}, {"VALUE"}});
  for (const Reading& reading : readings) {
    table.add({base::text::safe(reading.description.name), type_text(reading.description),
               std::string(cnc::variables::name_of(reading.description.access)),
               text_of(reading.elements, reading.is_array)});
  }
  fmt::print("{}", table.text());
}

int read_all(const ReadOptions& options, Source& source) {
  std::vector<Reading> readings;
  for (auto& reading : source.read(options.names)) {
    if (reading) {
      readings.push_back(std::move(*reading));
    } else {
      print_failure(options, reading.error());
    }
  }
  if (!readings.empty() || options.json) {
    show(options, readings);
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
          "A variable, as the program writes it; an array is read as a whole without index. "
          "Through a gateway also an object: block_number, mc_active_feed_override_r")
      ->required();
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return with_source(*options, [&](Source& source) { return read_all(*options, source); });
    };
  });
}

}  // namespace millrace::tools::commands::vars
