// The addresses of IPv4 that this host has.
#pragma once

#include <chrono>
#include <cstdint>
#include <set>

namespace millrace::services::lcm {

class LocalAddresses {
 public:
  /// Looks again for an address that it does not know, at most once a second.
  bool has(std::uint32_t address, std::chrono::steady_clock::time_point now);

 private:
  std::set<std::uint32_t> known_;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace millrace::services::lcm
