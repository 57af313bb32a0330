// The cost of Secure ADS compared with plain ADS: for a connection alone, and for a gateway.
#pragma once

namespace millrace::bench {

/// Reads per second, and the time to connect. True if the goals are met.
bool measure_secure_links();

}  // namespace millrace::bench
