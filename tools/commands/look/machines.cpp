// millrace machines: the links between gateways and controllers.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;

void print_machines(const bus::FabricModel& live) {
  print::Table table({{"MACHINE"},
                      {"LINK"},
                      {"SINCE", Align::right},
                      {"ADDRESS"},
                      {"CHANNELS", Align::right},
                      {"POLL", Align::right},
                      {"REQUESTS/S", Align::right},
                      {"ROUND TRIP", Align::right},
                      {"GATEWAY"},
                      {"WHY"}});
  for (const auto& [key, status] : live.machines()) {
    table.add({base::text::safe(status.machine), status.connected ? "up" : "down",
               ago(status.since), base::text::safe(status.address), std::to_string(status.channels),
               print::duration_text(status.poll), std::to_string(status.requests_per_second),
               print::duration_text(status.round_trip),
               fmt::format("{} ({}), {}", base::text::safe(status.host), status.pid,
                           base::text::safe(status.version)),
               base::text::safe(status.reason)});
  }
  fmt::print("{}", table.text());
}

int list_machines(const LookOptions& options) {
  const bus::FabricModel live = options.look();
  if (options.json) {
    boost::json::array out;
    for (const auto& [key, status] : live.machines()) {
      boost::json::object object;
      print::put_machine(object, status);
      out.push_back(std::move(object));
    }
    print::print_json(out);
  } else if (live.machines().empty()) {
    fmt::print("no gateway on fabric '{}', domain {} publishes machines\n",
               options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    print_machines(live);
  }
  return base::program::exit_done;
}

}  // namespace

void add_machines(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "machines", "The connection to each controller: state, poll period, requests",
      "millrace machines");
  auto options = std::make_shared<LookOptions>(command);
  command.callback(
      [options, &chosen] { chosen.run = [options] { return list_machines(*options); }; });
}

}  // namespace millrace::tools::commands::look
