// Reads and checks lcm.textproto (schema and defaults: idl/lcm.proto).
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>

#include <tl/expected.hpp>

#include "services/lcm/rules.hpp"

namespace millrace::services::lcm {

/// The network of LCM's messages.
struct Network {
  /// As in the configuration.
  std::string url = "udpm://239.255.76.67:7667?ttl=0";
  std::string group = "239.255.76.67";
  std::uint16_t port = 7667;
  /// 0 = messages stay on this host, and messages of other hosts are ignored.
  std::uint8_t ttl = 0;
  /// Address of the interface.
  std::string interface = "127.0.0.1";
};

struct Mirror {
  /// Canonical UUIDs.
  std::set<std::string> without_text{};
};

struct Config {
  Network network{};
  Rules rules{};
  std::optional<Mirror> mirror{};
};

/// The error has one line per mistake, with file, line and column.
tl::expected<Config, std::string> load(const std::filesystem::path& file);

}  // namespace millrace::services::lcm
