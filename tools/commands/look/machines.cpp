// millrace machines: the links between gateways and controllers.
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::look {

namespace {

using fabric::MachineStatus;
using print::Align;
using print::Cell;

std::string link_of(const MachineStatus& status) {
  return status.gone ? "no gateway" : status.connected ? "up" : "down";
}

Cell poll_of(const MachineStatus& status) {
  return status.watch == fabric::WatchMode::pushed ? Cell(std::string("on change"))
                                                   : Cell(status.poll);
}

Cell gateway_of(const MachineStatus& status) {
  return status.gone ? Cell() : fmt::format("{} ({}), {}", status.host, status.pid, status.version);
}

template <typename T>
Cell if_known(T value) {
  return value == T{} ? Cell() : Cell(value);
}

const print::Listing<MachineStatus>& machines_listing() {
  static const auto machines = print::Listing<MachineStatus>{
      {"MACHINE", "", [](const auto& it) -> Cell { return it.machine; }},
      {"LINK", "", [](const auto& it) -> Cell { return link_of(it); }},
      {"SINCE", "", [](const auto& it) -> Cell { return it.since; }, Align::right, 1},
      {"ADDRESS", "", [](const auto& it) -> Cell { return it.address; }, Align::left, 6},
      {"CHANNELS", "", [](const auto& it) -> Cell { return std::int64_t{it.channels}; },
       Align::right, 4},
      {"POLL", "", &poll_of, Align::right, 5},
      {"REQUESTS/S", "",
       [](const auto& it) { return if_known(std::int64_t{it.requests_per_second}); }, Align::right,
       8},
      {"ROUND TRIP", "", [](const auto& it) { return if_known(it.round_trip); }, Align::right, 3},
      {"GATEWAY", "", &gateway_of, Align::left, 7},
      {"WHY", "", [](const auto& it) -> Cell {
         return it.reason;
       }}}.with_fields<MachineStatus>([](const auto& it) { return &it; });
  return machines;
}

int list_machines(const LookOptions& options) {
  const bus::FabricModel live = options.look();
  std::vector<MachineStatus> rows;
  Names known;
  for (const auto& [key, status] : live.machines()) {
    rows.push_back(status);
    known.push_back(status.machine);
  }
  rows = chosen(std::move(rows), options.what,
                [](const MachineStatus& status) { return Names{status.machine}; });
  std::ranges::stable_partition(rows, [](const MachineStatus& it) { return !it.connected; });
  return options.show(machines_listing(), rows, "machine", known,
                      "no gateway on fabric '{}', domain {} publishes machines");
}

}  // namespace

void add_machines(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "machines", "The connection to each controller: state, poll period, requests",
      "millrace machines\n  millrace machines press --json");
  auto options = std::make_shared<LookOptions>(command, "M", "Only this machine; all by default");
  command.callback(
      [options, &chosen] { chosen.run = [options] { return list_machines(*options); }; });
}

}  // namespace millrace::tools::commands::look
