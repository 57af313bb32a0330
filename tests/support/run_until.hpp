// Waiting for a condition in a test instead of sleeping.
//
//   EXPECT_TRUE(run_until(context, [&] { return replies.size() == 1; }));
#pragma once

#include <chrono>
#include <functional>

#include <boost/asio/io_context.hpp>

namespace millrace::tests {

/// Runs `context` until `done` is true or `limit` is over; returns the last result of `done`, which
/// is not called again after it was true.
inline bool run_until(boost::asio::io_context& context, const std::function<bool()>& done,
                      std::chrono::milliseconds limit = std::chrono::seconds(10)) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!done()) {
    if (std::chrono::steady_clock::now() >= end) {
      return false;
    }
    context.restart();
    context.run_one_for(std::chrono::milliseconds(10));
  }
  return true;
}

}  // namespace millrace::tests
