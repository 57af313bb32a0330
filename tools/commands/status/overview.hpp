// The text and the JSON of `millrace status`: concerns, machines, and what processes report. Pure.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <boost/json/object.hpp>

#include "fabric/plant/plant.hpp"
#include "tools/commands/status/exit_codes.hpp"

namespace millrace::tools::commands::status {

/// Which processes; none = those of all hosts.
using Host = std::optional<std::string>;
inline bool is_on(const Host& wanted, const std::string& host) {
  return !wanted || *wanted == host;
}

/// A machine, with the status of the gateway that has its link, or that reports at all.
struct MachineRow {
  const fabric::MachineStatus* status = nullptr;
  std::map<fabric::ChannelState, int> channels{};
};

/// Those without a connection first.
std::vector<MachineRow> machine_rows(const fabric::plant::Plant& live, const Host& host);
std::vector<fabric::Alarm> alarms_on(const fabric::plant::Plant& live, const Host& host);

struct Overview {
  const fabric::plant::Plant& live;
  std::string fabric{};
  std::uint32_t domain = 0;
  Host host{};
  Concerns concerns{};
  /// A line for each process that was asked.
  std::string answers{};
};
/// For a terminal of `width` characters; 0 = unlimited.
std::string text_of(const Overview& overview, std::size_t width, fabric::Time now);
/// As `millrace status --json` prints it.
boost::json::object json_of(const Overview& overview);

}  // namespace millrace::tools::commands::status
