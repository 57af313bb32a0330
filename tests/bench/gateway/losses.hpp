// Lost instances: how soon their calls run elsewhere, and whether a running one is regarded as
// lost. False if a goal is missed.
#pragma once

#include <chrono>

namespace millrace::bench {

/// kill -9 of an instance until its call is dispatched to another.
bool measure_takeover();
/// Instances regarded as lost by mistake during this time, while both cores are loaded.
bool measure_alarms(std::chrono::seconds time);

}  // namespace millrace::bench
