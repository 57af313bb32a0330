// millrace channels: what each channel does, and why it waits.
#include <boost/json/array.hpp>
#include <fmt/format.h>

#include "base/program/command_line.hpp"
#include "base/text/quoted.hpp"
#include "fabric/words.hpp"
#include "tools/commands/look/look.hpp"
#include "tools/print/json.hpp"
#include "tools/print/table.hpp"
#include "tools/print/units.hpp"

namespace millrace::tools::commands::look {

namespace {

using print::Align;

std::string call_text(const fabric::ChannelStatus& status) {
  if (status.call == fabric::CallId{}) {
    return "-";
  }
  return status.attempt > 1 ? fmt::format("{} #{}", status.call.to_string(), status.attempt)
                            : status.call.to_string();
}

/// Its state, or what is the cause of it.
std::string state_text(const bus::FabricModel& live, const fabric::ChannelStatus& status) {
  switch (live.obstacle_of(status, std::chrono::system_clock::now())) {
    case bus::Obstacle::journal:
      return "no new calls";
    case bus::Obstacle::unserved:
      return std::string(fabric::name_of(fabric::ChannelState::unserved));
    default:
      return std::string(fabric::name_of(status.state));
  }
}

void print_channels(const bus::FabricModel& live) {
  print::Table table({{"CHANNEL"},
                      {"STATE"},
                      {"SINCE", Align::right},
                      {"CALL"},
                      {"UUID"},
                      {"CALLS", Align::right},
                      {"ANSWERED", Align::right},
                      {"FAILED", Align::right},
                      {"WHY"}});
  for (const auto& [key, status] : live.channels()) {
    table.add({base::text::safe(key.to_string()), state_text(live, status), ago(status.since),
               call_text(status), status.uuid.empty() ? "-" : base::text::safe(status.uuid),
               std::to_string(status.calls), std::to_string(status.answered),
               std::to_string(status.failed), base::text::safe(status.reason)});
  }
  fmt::print("{}", table.text());
}

boost::json::array channels_json(const bus::FabricModel& live) {
  boost::json::array out;
  for (const auto& [key, status] : live.channels()) {
    out.push_back(print::json_of(status));
  }
  return out;
}

int list_channels(const LookOptions& options) {
  const bus::FabricModel live = options.look();
  if (options.json) {
    print::print_json(channels_json(live));
  } else if (live.channels().empty()) {
    fmt::print(
        "no gateway is on fabric '{}', domain {}, or none has a connection to its machine yet\n",
        options.fabric.options().fabric, options.fabric.options().domain);
  } else {
    print_channels(live);
  }
  return base::program::exit_done;
}

}  // namespace

void add_channels(CLI::App& app, Chosen& chosen) {
  CLI::App& command =
      add_subcommand(app, "channels", "State of each channel, its current call, and why it waits",
                     "millrace channels");
  auto options = std::make_shared<LookOptions>(command);
  command.callback(
      [options, &chosen] { chosen.run = [options] { return list_channels(*options); }; });
}

}  // namespace millrace::tools::commands::look
