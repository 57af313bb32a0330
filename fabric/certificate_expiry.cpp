#include "fabric/certificate_expiry.hpp"

#include <fmt/format.h>

namespace millrace::fabric {

std::string time_left(std::chrono::sys_seconds until, std::chrono::sys_seconds now) {
  const auto left = until - now;
  return left < std::chrono::days(2)
             ? fmt::format("{} hours", std::chrono::floor<std::chrono::hours>(left).count())
             : fmt::format("{} days", std::chrono::floor<std::chrono::days>(left).count());
}

}  // namespace millrace::fabric
