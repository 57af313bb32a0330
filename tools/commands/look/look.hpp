// Subcommands that show a fabric once: `services`, `channels`, `machines`. One source file each.
#pragma once

#include <chrono>
#include <string>

#include "fabric/plant/plant.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/bus/snapshot.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/names.hpp"
#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands::look {

void add_services(CLI::App& app, Chosen& chosen);
void add_channels(CLI::App& app, Chosen& chosen);
void add_machines(CLI::App& app, Chosen& chosen);

/// Which fabric, and how long to listen.
struct SnapshotOptions {
  /// Adds the flags to `command`.
  explicit SnapshotOptions(CLI::App& command);

  /// Joins, listens and leaves.
  [[nodiscard]] fabric::plant::Plant look() const;

  fabric::profile::FabricFlags fabric;
  std::chrono::nanoseconds wait;
};

/// The same, and what a listing shows and in which form.
struct LookOptions : SnapshotOptions {
  /// Adds the flags and the argument `what_name`.
  LookOptions(CLI::App& command, const std::string& what_name, const std::string& what_help);

  /// Prints the rows. Without rows: says that there is no such `kind` as WHAT and which are
  /// `known`, or `nothing`, a format of fabric and domain. The exit code.
  template <typename Row>
  int show(const print::Listing<Row>& listing, const std::vector<Row>& rows,
           const std::string& kind, const Names& known, const char* nothing) const {
    if (rows.empty() && !what.empty()) {
      return print_unknown(kind, what, known, fabric.options());
    }
    if (rows.empty() && output.is_text()) {
      fmt::print("{}\n", fmt::format(fmt::runtime(nothing), fabric.options().fabric,
                                     fabric.options().domain));
    } else {
      print_listing(listing, rows, output);
    }
    return base::program::exit_done;
  }

  ListingFlags output;
  std::string what;
};

}  // namespace millrace::tools::commands::look
