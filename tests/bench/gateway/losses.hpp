// Instances that are lost: how soon their calls run elsewhere, and whether any is taken for lost
// that is not. False if a goal is missed.
#pragma once

#include <chrono>

namespace millrace::bench {

/// kill -9 of an instance until its call is given to another.
bool measure_takeover();
/// Instances lost by mistake in so much time, while both cores are loaded.
bool measure_alarms(std::chrono::seconds time);

}  // namespace millrace::bench
