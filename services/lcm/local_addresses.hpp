// The IPv4 addresses of this host.
#pragma once

#include <chrono>
#include <cstdint>
#include <set>

namespace millrace::services::lcm {

class LocalAddresses {
 public:
  /// Reads the addresses again for an unknown one, at most once a second.
  bool has(std::uint32_t address, std::chrono::steady_clock::time_point now);

 private:
  std::set<std::uint32_t> known_;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace millrace::services::lcm
