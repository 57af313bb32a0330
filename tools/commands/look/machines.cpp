// millrace machines: the links between gateways and controllers.
#include "tools/commands/look/machines.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "tools/commands/look/look.hpp"

namespace millrace::tools::commands::look {

namespace {

using fabric::MachineStatus;
using print::Align;
using print::Cell;

template <typename T>
Cell if_known(T value) {
  return value == T{} ? Cell() : Cell(value);
}

Cell poll_of(const MachineStatus& status) {
  return status.watch == fabric::WatchMode::pushed ? Cell(std::string("on change"))
                                                   : if_known(status.poll);
}

Cell gateway_of(const MachineStatus& status) {
  return status.gone ? Cell() : fmt::format("{} ({}), {}", status.host, status.pid, status.version);
}

int list_machines(const LookOptions& options) {
  const std::vector<MachineStatus> rows = machine_rows(options.look());
  Names known;
  for (const MachineStatus& status : rows) {
    known.push_back(status.machine);
  }
  return options.show(
      machines_listing(),
      chosen(rows, options.what, [](const MachineStatus& status) { return Names{status.machine}; }),
      "machine", known, "no gateway on fabric '{}', domain {} publishes machines");
}

}  // namespace

std::string link_of(const MachineStatus& status) {
  return status.gone ? "no gateway" : status.connected ? "up" : "down";
}

std::vector<MachineStatus> machine_rows(const fabric::plant::Plant& live) {
  std::vector<MachineStatus> rows;
  for (const auto& [key, status] : live.machines()) {
    rows.push_back(status);
  }
  std::ranges::stable_partition(rows, std::logical_not(), &MachineStatus::connected);
  return rows;
}

const print::Listing<MachineStatus>& machines_listing() {
  static const auto machines = print::Listing<MachineStatus>{
      {"MACHINE", "", [](const auto& it) -> Cell { return it.machine; }},
      {"LINK", "", [](const auto& it) -> Cell { return link_of(it); }},
      {"SINCE", "", [](const auto& it) -> Cell { return it.since; }, Align::right, 1},
      {"ADDRESS", "", [](const auto& it) -> Cell { return it.address; }, Align::left, 6},
      {"CHANNELS", "", [](const auto& it) { return if_known(std::int64_t{it.channels}); },
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

void add_machines(CLI::App& app, Chosen& chosen) {
  CLI::App& command = add_subcommand(
      app, "machines", "The connection to each controller: state, poll period, requests",
      "millrace machines\n  millrace machines press --json");
  auto options = std::make_shared<LookOptions>(command, "M", "Only this machine; all by default");
  run_if_chosen(command, chosen, options, list_machines);
}

}  // namespace millrace::tools::commands::look
