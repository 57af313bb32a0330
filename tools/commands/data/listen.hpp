// Listening to machine data and program events: once, or until a signal.
//
//   DataOptions options(command, "sample");
//   const auto wanted = [&](const recording::Entry& entry) { … };
//   if (options.follows) return follow(options, wanted);
//   const auto [entries, machines] = receive(options, wanted);
//   return options.show(listing, entries, machines, "no gateway …");
#pragma once

#include <chrono>
#include <functional>
#include <string>

#include "base/program/command_line.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/names.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::commands::data {

struct DataOptions {
  /// Adds MACHINE, --channel, --follow, --count, --wait, and the flags of listings and the fabric.
  DataOptions(CLI::App& command, const std::string& what);

  /// Whether the sample is of a wanted machine and channel.
  [[nodiscard]] bool takes(const fabric::ChannelKey& key) const;

  /// Prints the rows. Without rows: that the machine is not among the `known`, or `nothing`, a
  /// format of fabric and domain. The exit code.
  template <typename Row>
  int show(const print::Listing<Row>& listing, const std::vector<Row>& rows, const Names& known,
           const char* nothing) const {
    if (rows.empty() && !machine.empty()) {
      return report_no_data(known);
    }
    if (rows.empty() && output.is_text()) {
      fmt::print("{}\n", fmt::format(fmt::runtime(nothing), fabric.options().fabric,
                                     fabric.options().domain));
    } else {
      print_listing(listing, rows, output);
    }
    return base::program::exit_done;
  }

  fabric::profile::FabricFlags fabric;
  ListingFlags output;
  std::string machine;
  std::uint16_t channel = 0;
  bool follows = false;
  std::uint64_t count = 0;
  std::chrono::nanoseconds wait;

 private:
  [[nodiscard]] int report_no_data(const Names& known) const;
};

using Wanted = std::function<bool(const recording::Entry&)>;

/// --follow: a line for each entry that is `wanted`, until a signal, --count, or the output is
/// closed. Returns the exit code.
int follow(const DataOptions& options, const Wanted& wanted);
struct Received {
  /// The last wanted one of each channel and group.
  std::vector<recording::Entry> entries{};
  /// With MACHINE: the machines of the fabric.
  Names machines{};
};
/// What comes within --wait.
Received receive(const DataOptions& options, const Wanted& wanted);

}  // namespace millrace::tools::commands::data
