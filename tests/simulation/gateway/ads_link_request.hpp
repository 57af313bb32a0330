// A request of a gateway to a controller, on its way there and back; only for ads_link*.cpp.
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
  /// The controller will never execute it.
  bool dropped = false;
  bool executed = false;
  /// The gateway knows the result.
  bool settled = false;
  std::uint64_t connection = 0;
  std::uint64_t controller_life = 0;
};

}  // namespace millrace::tests::simulation
