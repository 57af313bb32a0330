// The sampled data of a machine, from the configuration (idl/gateway.proto, Data).
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace millrace::gateway::data {

/// Values that are read together, and published together.
struct GroupSettings {
  /// A unique name in its channel; at most 63 characters.
  std::string name;
  std::uint16_t channel = 1;
  /// Variables as programs write them, objects as cnc/variables/objects.hpp has them.
  std::vector<std::string> names;
  std::chrono::milliseconds period{1000};
  /// A number counts as changed when it differs by more than this from the last published one.
  double deadband = 0;
  /// Published on each cycle; otherwise when a value is another one.
  bool always = false;
  bool operator==(const GroupSettings&) const = default;
};

struct DataSettings {
  std::vector<GroupSettings> groups;
  /// The request budget of all groups of the machine; calls have their own.
  double requests_per_second = 50;
  bool operator==(const DataSettings&) const = default;
};

}  // namespace millrace::gateway::data
