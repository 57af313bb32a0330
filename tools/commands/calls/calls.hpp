// `millrace calls`: the calls of a fabric.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "fabric/profile/command_line.hpp"
#include "tools/commands/listing_flags.hpp"
#include "tools/commands/subcommand.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::commands::calls {

void add_calls(CLI::App& app, Chosen& chosen);

struct CallsOptions {
  explicit CallsOptions(CLI::App& command);

  fabric::profile::FabricFlags fabric;
  ListingFlags output;
  std::chrono::nanoseconds wait;
  std::string call{};
  recording::Filter filter{};
  bool follow = false;
  std::optional<std::uint64_t> count{};
  bool lines = false;
};

/// Calls as they end, until a signal or --count. The exit code.
int follow(const CallsOptions& options);

}  // namespace millrace::tools::commands::calls
