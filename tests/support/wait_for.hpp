// Runs a coroutine to its end in a test, on the io_context that also runs everything else.
//
//   const auto state = wait_for(io, client.state(552));
#pragma once

#include <chrono>
#include <exception>
#include <functional>
#include <optional>
#include <stdexcept>
#include <utility>

#include <boost/asio/awaitable.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/io_context.hpp>

namespace millrace::tests {

// Waiting for a condition in a test instead of sleeping.
//
//   EXPECT_TRUE(run_until(context, [&] { return replies.size() == 1; }));

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

/// Rethrows the coroutine's exception; throws std::runtime_error if it does not end.
inline void wait_for(boost::asio::io_context& io, boost::asio::awaitable<void> work) {
  bool done = false;
  std::exception_ptr failure;
  boost::asio::co_spawn(io, std::move(work), [&](std::exception_ptr error) {
    failure = error;
    done = true;
  });
  if (!run_until(io, [&] { return done; })) {
    throw std::runtime_error("the coroutine did not end");
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
}

/// Keeps the result of `work`; T needs no default constructor.
template <typename T>
boost::asio::awaitable<void> keep(boost::asio::awaitable<T> work, std::optional<T>& result) {
  result.emplace(co_await std::move(work));
}

/// The same for a coroutine with a result.
template <typename T>
T wait_for(boost::asio::io_context& io, boost::asio::awaitable<T> work) {
  std::optional<T> result;
  wait_for(io, keep(std::move(work), result));
  return std::move(*result);
}

}  // namespace millrace::tests
