// What a gateway asks of a controller, on its way there and back; ads_link*.cpp alone know it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "tests/simulation/gateway/ads_link.hpp"

namespace millrace::tests::simulation {

struct AdsLink::Request {
  std::uint16_t channel = 0;
  std::optional<Work> work;
  std::optional<AdsWrite> write;
  gateway::ServiceSnapshot snapshot;
  std::vector<gateway::Variable> variables;
  Time first{};
  bool refused = false;
  /// The controller will never do it.
  bool dropped = false;
  bool executed = false;
  /// The gateway knows how it ended.
  bool settled = false;
  std::uint64_t connection = 0;
  std::uint64_t controller_life = 0;
};

}  // namespace millrace::tests::simulation
