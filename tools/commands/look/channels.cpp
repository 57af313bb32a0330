// millrace channels: what each channel does, and why it waits.
#include "tools/commands/look/channels.hpp"

#include <algorithm>
#include <functional>

#include <fmt/format.h>

#include "fabric/channel_scope.hpp"
#include "tools/commands/look/watch.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;
using print::Cell;

Cell call_of(const ChannelRow& row) {
  const fabric::ChannelStatus& status = row.status;
  if (status.call == fabric::CallId{}) {
    return {};
  }
  return status.attempt > 1 ? fmt::format("{} #{}", status.call.to_string(), status.attempt)
                            : status.call.to_string();
}

Names names_of_channel(const ChannelRow& row) {
  const fabric::ChannelKey& key = row.status.key;
  return {key.to_string(), key.machine, std::string(fabric::machine_of(key.machine))};
}

/// Of an instance, or of one that is gone; otherwise empty.
std::string name_of_service(const fabric::plant::Plant& live, const std::string& uuid) {
  if (uuid.empty()) {
    return "";
  }
  if (const auto instances = live.instances_of(uuid); !instances.empty()) {
    return instances.front()->identity.name;
  }
  const auto gone = std::ranges::find_if(live.gone(), [&](const auto& each) {
    return each.second.last.identity.uuid == fabric::canonical_uuid(uuid);
  });
  return gone == live.gone().end() ? "" : gone->second.last.identity.name;
}

struct ChannelsOptions : LookOptions {
  explicit ChannelsOptions(CLI::App& command)
      : LookOptions(command, "M[/N]", "Only this machine or channel; all by default"),
        watch(command, {"--json", "--csv", "-o"}) {}

  WatchFlag watch;
};

std::vector<ChannelRow> wanted_rows(const ChannelsOptions& options,
                                    const std::vector<ChannelRow>& rows) {
  return chosen(rows, options.what, &names_of_channel);
}

int list_channels(const ChannelsOptions& options) {
  if (options.watch.on) {
    return watch(options, [&](const fabric::plant::Plant& live) {
      const auto now = std::chrono::system_clock::now();
      return channels_listing().text(wanted_rows(options, channel_rows(live, now)),
                                     options.output.format(channels_listing().headings()), now);
    });
  }
  const std::vector<ChannelRow> rows =
      channel_rows(options.look(), std::chrono::system_clock::now());
  Names known;
  for (const ChannelRow& row : rows) {
    known.push_back(row.status.key.to_string());
  }
  return options.show(
      channels_listing(), wanted_rows(options, rows), "channel", known,
      "no gateway is on fabric '{}', domain {}, or none has a connection to its machine yet");
}

}  // namespace

std::vector<ChannelRow> channel_rows(const fabric::plant::Plant& live, fabric::Time now) {
  std::vector<ChannelRow> rows;
  for (const auto& [key, status] : live.channels()) {
    rows.push_back({status, view_of(live, status, now), name_of_service(live, status.uuid)});
  }
  std::ranges::stable_sort(rows, std::greater(),
                           [](const ChannelRow& row) { return row.view.level; });
  return rows;
}

const print::Listing<ChannelRow>& channels_listing() {
  static const auto channels = print::Listing<ChannelRow>{
      {"CHANNEL", "", [](const ChannelRow& row) -> Cell { return row.status.key.to_string(); }},
      {"STATE", "", [](const ChannelRow& row) -> Cell { return std::string(row.view.state); }},
      {"SINCE", "", [](const ChannelRow& row) -> Cell { return row.view.since; }, Align::right, 1},
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
         return row.view.why;
       }}}.with_fields<fabric::ChannelStatus>([](const ChannelRow& row) { return &row.status; });
  return channels;
}

void add_channels(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "channels", "State of each channel, its current call, and why it waits",
                     "millrace channels\n  millrace channels press --watch");
  auto options = std::make_shared<ChannelsOptions>(command);
  run_if_chosen(command, chosen, options, list_channels);
}

}  // namespace millrace::tools::commands::look
