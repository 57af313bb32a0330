// Subcommands that show a fabric once: `services`, `info`, `stats`, `channels`, `machines`. One
// source file each.
#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "fabric/profile/command_line.hpp"
#include "tools/bus/fabric_model.hpp"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::look {

void add_services(CLI::App& app, Chosen& chosen);
void add_info(CLI::App& app, Chosen& chosen);
void add_stats(CLI::App& app, Chosen& chosen);
void add_channels(CLI::App& app, Chosen& chosen);
void add_machines(CLI::App& app, Chosen& chosen);

/// The common options of these subcommands: fabric, listening time, output format.
struct LookOptions {
  /// Adds the flags to `command`.
  explicit LookOptions(CLI::App& command);

  /// Joins, listens and leaves.
  [[nodiscard]] bus::FabricModel look() const;

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds wait;
  bool json = false;
};

/// "cnc/1 cnc/2"; "all" for no restriction.
std::string channels_text(const fabric::InstanceIdentity& identity);
/// "3 min ago"; "-" for a time that is not known.
std::string ago(fabric::Time time);

}  // namespace millrace::tools::commands::look
