// Waiting in a test for something that happens in other threads or processes.
//
//   await("the first mail", [&] { return fs::exists(mail); });
#pragma once

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace millrace::tests {

/// Far more than anything takes on a busy host, in a build that is not optimised.
inline constexpr std::chrono::seconds await_limit{30};

/// Returns when `done()` is true. Throws std::runtime_error, which names `what` was waited for,
/// when `limit` is over. Never spins: who is waited for needs the core.
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
