// What a caller expects of a plant and is not there. Pure.
#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "fabric/plant/concern.hpp"
#include "fabric/plant/plant.hpp"

namespace millrace::fabric::plant {

/// Concerns for expected machines, or hosts of gateways, without a gateway.
std::vector<Concern> missing_gateways(const Plant& plant, const std::vector<std::string>& names);
/// Service by UUID or name, and the number of instances that it must have, without draining ones.
using Expected = std::vector<std::pair<std::string, std::size_t>>;
std::vector<Concern> missing_instances(const Plant& plant, const Expected& services);

}  // namespace millrace::fabric::plant
