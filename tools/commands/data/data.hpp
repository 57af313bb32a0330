// `millrace data`, `millrace programs` and `millrace queues`: what gateways publish about their
// machines besides calls.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "fabric/observer/observer.hpp"
#include "fabric/profile/command_line.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::commands::data {

void add_data(CLI::App& app, Chosen& chosen);
void add_programs(CLI::App& app, Chosen& chosen);
void add_queues(CLI::App& app, Chosen& chosen);

// Listening to machine data and program events: once, or until a signal.
//
//   DataOptions options(command);
//   listen(options, [&](const recording::Entry& entry) { …; return true; });    // false = enough
//   return follow(options, [&](const recording::Entry& entry) { return wanted(entry); });

struct DataOptions {
  /// Adds MACHINE, --channel, --watch, --count, --wait, --json and the fabric's flags.
  DataOptions(CLI::App& command, const std::string& what);

  /// Whether the sample is of a wanted machine and channel.
  [[nodiscard]] bool takes(const fabric::ChannelKey& key) const;

  fabric::profile::FabricFlags fabric;
  std::string machine;
  std::uint16_t channel = 0;
  bool watch = false;
  std::uint64_t count = 0;
  std::chrono::nanoseconds wait;
  bool json = false;
};

/// Joins, hands out each entry, and leaves: after a signal, after `wait` unless that is nothing, or
/// when `on_entry` returns false.
void listen(const fabric::dds::ParticipantOptions& fabric, fabric::observer::Interest interest,
            std::optional<std::chrono::nanoseconds> wait,
            const std::function<bool(const recording::Entry&)>& on_entry);
/// Machine data: with --watch until a signal, otherwise for a while.
void listen(const DataOptions& options,
            const std::function<bool(const recording::Entry&)>& on_entry);

/// --watch: a line for each entry that is `wanted`, until a signal, --count, or the output is
/// closed. Returns the exit code.
int follow(const DataOptions& options, const std::function<bool(const recording::Entry&)>& wanted);

/// Says that the gateways tell of no such data of the machine, and which machines there are. The
/// exit code.
int report_unknown_machine(const DataOptions& options);

/// "1m57s"; "-" for a time that is not known.
std::string ago(fabric::Time time);
/// The column WHY: the reason, and that it comes from a recording.
std::string why(const std::string& reason, bool replayed);

}  // namespace millrace::tools::commands::data
