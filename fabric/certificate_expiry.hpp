// When the expiry of a certificate needs a warning, and how far off it is. Pure.
#pragma once

#include <chrono>
#include <string>

namespace millrace::fabric {

/// Time enough to renew a certificate and to go to its host.
inline constexpr std::chrono::days certificate_expires_soon{30};

/// "30 days"; in the last two days "40 hours".
std::string time_left(std::chrono::sys_seconds until, std::chrono::sys_seconds now);

}  // namespace millrace::fabric
