// What Secure ADS costs beside plain ADS: a connection by itself, and a gateway with it.
#pragma once

namespace millrace::bench {

/// Reads per second, the time until a link is up. True if the goals are met.
bool measure_secure_links();

}  // namespace millrace::bench
