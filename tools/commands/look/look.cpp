#include "tools/commands/look/look.hpp"

#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "fabric/channel_scope.hpp"
#include "fabric/words.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/arguments.hpp"
#include "tools/print/json.hpp"

namespace millrace::tools::commands::look {

SnapshotOptions::SnapshotOptions(CLI::App& command)
    : fabric(command, {.name = "millrace"}), wait(bus::Patience{}.at_least) {
  add_duration(command, "--wait", wait,
               "Listen for at least this time; default 700ms. With trust up to 3s until all "
               "participants are authenticated");
}

bus::FabricModel SnapshotOptions::look() const {
  bus::Patience patience;
  patience.at_least = std::chrono::ceil<std::chrono::milliseconds>(wait);
  patience.at_most += patience.at_least;
  return bus::take_snapshot(fabric.options(), patience);
}

LookOptions::LookOptions(CLI::App& command, const std::string& what_name,
                         const std::string& what_help)
    : SnapshotOptions(command), output(command) {
  command.add_option(what_name, what, what_help);
}

// millrace channels: what each channel does, and why it waits.

namespace {

using print::Align;
using print::Cell;

struct ChannelRow {
  fabric::ChannelStatus status{};
  bus::Obstacle obstacle{};
  /// Of the service, while an instance is known.
  std::string service{};
};

/// Its state, or what is the cause of it.
Cell state_of(const ChannelRow& row) {
  switch (row.obstacle) {
    case bus::Obstacle::journal:
      return std::string("no new calls");
    case bus::Obstacle::unserved:
      return std::string(name_of(fabric::ChannelState::unserved));
    default:
      return std::string(name_of(row.status.state));
  }
}

Cell call_of(const ChannelRow& row) {
  const fabric::ChannelStatus& status = row.status;
  if (status.call == fabric::CallId{}) {
    return {};
  }
  return status.attempt > 1 ? fmt::format("{} #{}", status.call.to_string(), status.attempt)
                            : status.call.to_string();
}

const print::Listing<ChannelRow>& channels_listing() {
  static const auto channels = print::Listing<ChannelRow>{
      {"CHANNEL", "", [](const ChannelRow& row) -> Cell { return row.status.key.to_string(); }},
      {"STATE", "", &state_of},
      {"SINCE", "", [](const ChannelRow& row) -> Cell { return row.status.since; }, Align::right,
       1},
      {"SERVICE", "", [](const ChannelRow& row) -> Cell { return row.service; }, Align::left, 2},
      {"CALL", "", &call_of, Align::left, 3},
      {"UUID", "", [](const ChannelRow& row) -> Cell { return row.status.uuid; }, Align::left, 7},
      {"CALLS", "",
       [](const ChannelRow& row) -> Cell { return static_cast<std::int64_t>(row.status.calls); },
       Align::right, 4},
      {"ANSWERED", "",
       [](const ChannelRow& row) -> Cell { return static_cast<std::int64_t>(row.status.answered); },
       Align::right, 6},
      {"FAILED", "",
       [](const ChannelRow& row) -> Cell { return static_cast<std::int64_t>(row.status.failed); },
       Align::right, 5},
      {"WHY", "", [](const ChannelRow& row) -> Cell {
         return row.status.reason;
       }}}.with_fields<fabric::ChannelStatus>([](const ChannelRow& row) { return &row.status; });
  return channels;
}

/// A channel's call does not go on, or its controller is not heard.
bool is_problem(const ChannelRow& row) {
  return row.status.state == fabric::ChannelState::link_down ||
         (row.obstacle != bus::Obstacle::none && row.obstacle != bus::Obstacle::busy);
}

Names names_of_channel(const ChannelRow& row) {
  const fabric::ChannelKey& key = row.status.key;
  return {key.to_string(), key.machine, std::string(fabric::machine_of(key.machine))};
}

int list_channels(const LookOptions& options) {
  const bus::FabricModel live = options.look();
  std::vector<ChannelRow> rows;
  Names known;
  for (const auto& [key, status] : live.channels()) {
    const auto instances = live.instances_of(status.uuid);
    rows.push_back(
        {status, live.obstacle_of(status, std::chrono::system_clock::now()),
         status.uuid.empty() || instances.empty() ? "" : instances.front()->identity.name});
    known.push_back(key.to_string());
  }
  rows = chosen(std::move(rows), options.what, &names_of_channel);
  std::ranges::stable_partition(rows, &is_problem);
  return options.show(
      channels_listing(), rows, "channel", known,
      "no gateway is on fabric '{}', domain {}, or none has a connection to its machine yet");
}

}  // namespace

void add_channels(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "channels", "State of each channel, its current call, and why it waits",
                     "millrace channels\n  millrace channels press/2");
  auto options = std::make_shared<LookOptions>(command, "M[/N]",
                                               "Only this machine or channel; all by default");
  command.callback(
      [options, &chosen] { chosen.run = [options] { return list_channels(*options); }; });
}

// millrace machines: the links between gateways and controllers.

namespace {

using fabric::MachineStatus;

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
