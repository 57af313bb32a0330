// What the bridge is told to do with the programs it hears.
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

/// How texts are coded on LCM.
enum class Encoding : std::uint8_t { utf8, cp1252 };

/// What holds for the programs of one UUID, whatever they say.
struct ServiceRule {
  /// Empty = what the program says.
  std::vector<fabric::ChannelScope> channels{};
  std::optional<fabric::Delivery> delivery{};
  std::optional<std::uint32_t> concurrency{};
  Encoding encoding = Encoding::utf8;
};

struct Rules {
  /// A program that is silent for so long is gone; one whose clock is so far from ours, too: what
  /// is so old says nothing of now.
  std::chrono::milliseconds silence{1000};
  /// UUIDs that are not in `services` are served, too.
  bool any_uuid = true;
  std::size_t most_programs = 64;
  /// By canonical UUID.
  std::map<std::string, ServiceRule> services{};

  [[nodiscard]] const ServiceRule* find(const std::string& uuid) const {
    const auto rule = services.find(uuid);
    return rule == services.end() ? nullptr : &rule->second;
  }
};

}  // namespace millrace::services::lcm
