// `millrace replay`: a recording instead of machines, services or a controller.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <set>
#include <string>

#include <CLI/App.hpp>

#include "fabric/profile/command_line.hpp"
#include "tools/caller/slot.hpp"
#include "tools/commands/replay/report.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recording/entry.hpp"
#include "tools/replay/comparison.hpp"
#include "tools/replay/plan.hpp"
#include "tools/replay/player.hpp"

namespace millrace::tools::commands::replay {

// The command line of `millrace replay`.

/// As typed.
struct Options {
  explicit Options(CLI::App& command);

  fabric::profile::FabricFlags fabric;
  std::filesystem::path file;
  bool to_services = false;
  bool as_service = false;
  bool as_cnc = false;
  bool data = false;

  double rate = 1;
  bool fast = false;
  bool step = false;
  std::size_t rounds = 1;
  std::chrono::nanoseconds max_gap{};

  recording::Filter filter;
  tools::replay::ChannelMap channels;

  bool verify = false;
  tools::replay::Tolerances tolerances;
  bool json = false;

  /// The waiting time for services, or for a gateway, before the first call.
  std::chrono::nanoseconds wait = std::chrono::seconds(10);
  /// The waiting time for the response to a call.
  std::chrono::nanoseconds timeout = std::chrono::seconds(30);

  /// --as-service.
  std::uint32_t error_state = 500;
  /// --as-cnc.
  std::string listen = "127.0.0.1:48898";
  std::string net_id = "127.0.0.1.1.1";

  [[nodiscard]] tools::replay::Pace pace() const;
  [[nodiscard]] tools::replay::PlayOptions play() const {
    return {.pace = pace(), .rounds = rounds, .patience = timeout};
  }
  [[nodiscard]] const tools::replay::Tolerances* compared() const {
    return verify ? &tolerances : nullptr;
  }
};

/// Throws UsageError for flags that contradict each other.
void check(const Options& options);

void add_replay(CLI::App& app, Chosen& chosen);

// One source file for each kind. Each returns the exit code.
int to_services(const Options& options, const tools::replay::Plan& plan);
int as_service(const Options& options, const tools::replay::Plan& plan);
int as_cnc(const Options& options, const tools::replay::Plan& plan);
int data(const Options& options);

// The channels of a replay.

/// The channel for each recorded one: from --channel, otherwise one of a machine with the slot's
/// name. Throws UsageError if two of them are the same, or a name is too long.
std::map<fabric::ChannelKey, fabric::ChannelKey> channels_asked(
    const Options& options, const caller::Slot& slot, const std::set<fabric::ChannelKey>& recorded);

/// A channel that the user has named must not belong to a live machine: throws UsageError.
void check_free(const Options& options,
                const std::map<fabric::ChannelKey, fabric::ChannelKey>& channels);

}  // namespace millrace::tools::commands::replay
