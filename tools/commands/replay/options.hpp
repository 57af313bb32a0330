// The command line of `millrace replay`.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>

#include "fabric/profile/command_line.hpp"
#include "tools/recording/filter.hpp"
#include "tools/replay/channel_map.hpp"
#include "tools/replay/comparison.hpp"
#include "tools/replay/player.hpp"

namespace millrace::tools::commands::replay {

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

}  // namespace millrace::tools::commands::replay
