// The settings of a gateway: machines, fabric, journal.
//
//   Settings settings = read_settings("gateway.textproto");
//   settings.machines.push_back(parse_machine("press=10.0.0.5:48898/10.0.0.5.1.1"));
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cnc/ads/address.hpp"
#include "cnc/ads/security.hpp"
#include "fabric/dds/participant.hpp"
#include "gateway/data/group.hpp"
#include "gateway/journal/journal_writer.hpp"
#include "gateway/policy.hpp"
#include "gateway/programs/program_watch.hpp"
#include "gateway/queues/queue_settings.hpp"
#include "gateway/read_intervals.hpp"
#include "gateway/variables/write_rules.hpp"

namespace millrace::gateway::settings {

/// {channel} is the channel's number, {variable} the name: V.G.SERVICE.REQUEST_STATE. How a
/// controller calls its variables among its symbols, if it does, is not documented: our choice.
inline constexpr const char* default_symbol = "CH[{channel}].{variable}";

/// Where a controller is. The defaults are those of millrace-cnc, the virtual CNC, on this host.
struct ControllerAddress {
  std::string host = "127.0.0.1";
  std::uint16_t tcp_port = 48898;
  cnc::ads::NetId net_id{{127, 0, 0, 1, 1, 1}};
  cnc::ads::NetId source{{127, 0, 0, 1, 2, 1}};
  /// Secure ADS; otherwise plain ADS.
  std::optional<cnc::ads::Security> security{};
  bool operator==(const ControllerAddress&) const = default;
};

/// One machine, and how its controller is read.
struct MachineSettings {
  std::string name = "cnc";
  ControllerAddress controller{};
  /// Empty = all that the controller has.
  std::vector<std::uint16_t> channels{};
  ReadIntervals intervals{};
  SubscriptionMode watch = SubscriptionMode::automatic;
  /// The controller's symbol of a channel's variable.
  std::string symbol = default_symbol;
  data::DataSettings data{};
  std::vector<programs::ProgramSettings> programs{};
  variables::VariableSettings variables{};
  std::vector<queues::QueueSettings> queues{};
  bool operator==(const MachineSettings&) const = default;

  /// Whether others can read and change its traffic: plain ADS to another host.
  [[nodiscard]] bool is_open_to_the_network() const;
  /// "127.0.0.1:48898, 127.0.0.1.1.1", and ", Secure ADS" if it is that.
  [[nodiscard]] std::string address() const;
  /// "cnc (127.0.0.1:48898, 127.0.0.1.1.1)"
  [[nodiscard]] std::string to_string() const;
};

struct Settings {
  std::vector<MachineSettings> machines;
  Policies policies;
  /// Not part of the file: from fabric.textproto.
  fabric::dds::ParticipantOptions join;
  /// An empty folder is that of default_journal_folder(), unless there is to be no journal.
  journal::FileOptions journal;
  bool no_journal = false;
};

/// Where a process keeps what survives it: the values of these environment variables, empty if
/// they are not set.
struct StateFolders {
  /// STATE_DIRECTORY of systemd; of several, the first one counts.
  std::string state_directory{};
  std::string xdg_state_home{};
  std::string home{};

  static StateFolders of_environment();
};

/// The folder of the journal where no setting names one: `STATE_DIRECTORY`, which belongs to one
/// unit, else millrace/gateway-DOMAIN-FABRIC below `XDG_STATE_HOME` or ~/.local/state. Not named
/// after the machines: a gateway that gets one more keeps its calls.
/// @throws base::program::UsageError if none of the variables is set
std::filesystem::path default_journal_folder(const StateFolders& folders, std::string_view fabric,
                                             std::uint32_t domain);

/// Throws base::program::UsageError with file, line and column of every mistake and what was
/// expected.
Settings read_settings(const std::filesystem::path& file);
/// The same of a text. `file` stands for its file in messages, and relative paths start beside it.
Settings parse_settings(const std::string& text, const std::filesystem::path& file);

/// "NAME=HOST:PORT/NETID"; ":PORT" may be left out, "/NETID" for an IPv4 address (then ".1.1" is
/// added to it). Throws base::program::UsageError.
MachineSettings parse_machine(const std::string& text);

/// Throws base::program::UsageError if two machines have one name.
void check_names(const std::vector<MachineSettings>& machines);

/// What is wrong with the name of a machine; empty if nothing is.
std::string wrong_name(const std::string& name);

}  // namespace millrace::gateway::settings
