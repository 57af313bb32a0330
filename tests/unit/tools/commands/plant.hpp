// An invented plant, for tests of listings. Machine `press` has a gateway with a held call, a call
// that waits, and a message queue; the gateway of `mill` is gone. Of three services one has two
// instances, and one has lost its only one. Two processes have alarms.
#pragma once

#include <vector>

#include "fabric/plant/plant.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::commands::tests {

/// All that an observer received until `plant_now`.
std::vector<recording::Entry> plant_entries();
fabric::plant::Plant plant();

/// Ten minutes after recording::tests::at(0).
inline const fabric::Time plant_now = recording::tests::at(600'000);

}  // namespace millrace::tools::commands::tests
