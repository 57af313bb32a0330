// Measurements with a virtual CNC over ADS: durations for a program, load of a controller,
// resources of a gateway process.
#pragma once

#include <cstddef>

namespace millrace::bench {

/// From REQUEST_STATE to RESPONSE_STATE in the program, through the gateway and with a service of
/// the vendor's design at the same period. True if the goal is met.
bool measure_program();
/// ADS requests per second for 20 services on 10 channels. True if the goal is met.
bool measure_controller_load();
/// Memory with 1,000 channels, processor time with 10 channels every 4 ms.
bool measure_idle();
/// A call, and the memory of a machine, with Secure ADS against plain ADS. True if the goals are
/// met.
bool measure_secure_gateway();
/// Calls per second of a virtual CNC with `channels` channels through the gateway; no goal.
void measure_over_ads(std::size_t channels);

}  // namespace millrace::bench
