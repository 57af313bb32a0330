// Selects entries by machine, channel, service, call and time.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

/// An empty set accepts everything; an entry without a machine (channel, service) passes a filter
/// for machines (channels, services) only if the set is empty.
struct Filter {
  std::set<std::string> machines{};
  std::set<std::uint16_t> channels{};
  /// Canonical.
  std::set<std::string> uuids{};
  std::set<std::string> kinds{};
  std::optional<fabric::CallId> call{};
  /// By time of recording, both ends included.
  fabric::Time from = fabric::Time::min();
  fabric::Time to = fabric::Time::max();

  [[nodiscard]] bool takes(const Entry& entry) const;
};

}  // namespace millrace::tools::recording
