// millrace vars MACHINE read: values of variables.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "cnc/variables/type.hpp"
#include "tools/commands/vars/vars.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"

namespace millrace::tools::commands::vars {

namespace {

namespace program = base::program;
using cnc::variables::Channel;

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

boost::asio::awaitable<int> read_all(const ReadOptions& options, Channel& channel) {
  std::vector<Reading> readings;
  for (const std::string& name : options.names) {
    auto reading = co_await read_one(options, channel, name);
    if (reading) {
      readings.push_back(std::move(*reading));
    }
  }
  if (!readings.empty() || options.json) {
    show(options, readings);
  }
  co_return readings.size() == options.names.size() ? program::exit_done : program::exit_failed;
}

}  // namespace

void add_read(CLI::App& vars, const Machine& machine, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(vars, "read", "The values of variables",
                     "millrace vars cnc read V.G.SERVICE.UUID 'V.E.TABLE[1]' V.A.ABS.X");
  auto options = std::make_shared<ReadOptions>(command, machine);
  command
      .add_option("NAME", options->names,
                  "A variable, as the program writes it; an array is read as a whole without index")
      ->required();
  command.callback([options, &chosen] {
    chosen.run = [options] {
      return on_channel(*options, [&](Channel& channel) { return read_all(*options, channel); });
    };
  });
}

}  // namespace millrace::tools::commands::vars
