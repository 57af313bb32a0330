// fabric/observer/entry.hpp for tools: a recording has the entries of an observer.
#pragma once

#include <cstdint>
#include <optional>
#include <set>
#include <string>

#include "fabric/observer/entry.hpp"

namespace millrace::tools::recording {

using fabric::observer::AlarmNews;
using fabric::observer::Change;
using fabric::observer::Entry;
using fabric::observer::InstanceNews;
using fabric::observer::Sample;
using fabric::observer::Withdrawal;

using fabric::observer::call_of;
using fabric::observer::channel_of;
using fabric::observer::is_failure;
using fabric::observer::kind_of;
using fabric::observer::machine_of;
using fabric::observer::origin_of;
using fabric::observer::text_of;
using fabric::observer::withhold_text;

// Selects entries by machine, channel, service, call and time.

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
