// Waiting in a test for an event in other threads or processes.
//
//   await("the first mail", [&] { return fs::exists(mail); });
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace millrace::tests {

/// Far more than anything takes in an unoptimised build on a busy host.
inline constexpr std::chrono::seconds await_limit{30};

/// Returns when `done()` is true. When `limit` is over, throws std::runtime_error, which names
/// `what` was waited for. It sleeps between checks: the process that is waited for needs the core.
template <typename Done>
void await(const std::string& what, const Done& done,
           std::chrono::milliseconds limit = await_limit) {
  constexpr std::chrono::milliseconds pace{1};
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!done()) {
    if (std::chrono::steady_clock::now() >= end) {
      throw std::runtime_error("waited " + std::to_string(limit.count()) + " ms in vain for " +
                               what);
    }
    std::this_thread::sleep_for(pace);
  }
}

}  // namespace millrace::tests
