// The bridge's rules for LCM processes.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "fabric/messages.hpp"

namespace millrace::services::lcm {

/// The encoding of texts on LCM.
enum class Encoding : std::uint8_t { utf8, cp1252 };

/// Settings for the LCM processes of one UUID, which override their announcements.
struct ServiceRule {
  /// Empty = as announced.
  std::vector<fabric::ChannelScope> channels{};
  std::optional<fabric::Delivery> delivery{};
  std::optional<std::uint32_t> concurrency{};
  Encoding encoding = Encoding::utf8;
};

struct Rules {
  /// An LCM process that is silent for this time is gone. A presence with a time that differs by
  /// more is ignored: it is outdated.
  std::chrono::milliseconds silence{1000};
  /// UUIDs that are not in `services` are served, too.
  bool any_uuid = true;
  /// At the same time: LCM has no access control.
  std::size_t most_programs = 64;
  /// By canonical UUID.
  std::map<std::string, ServiceRule> services{};

  [[nodiscard]] const ServiceRule* find(const std::string& uuid) const {
    const auto rule = services.find(uuid);
    return rule == services.end() ? nullptr : &rule->second;
  }
};

}  // namespace millrace::services::lcm
