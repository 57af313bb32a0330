// A handler that is a coroutine of Boost.Asio (1.77 or later) and runs on the program's io_context.
//
//   asio::io_context io;
//   const auto work = asio::make_work_guard(io);
//   std::jthread thread([&] { io.run(); });
//   const int code = serve(argc, argv, {.uuid = "b0ad2ab8-…", .concurrency = 8},
//                          coroutine(io.get_executor(), [](const Call&) -> asio::awaitable<Response> {
//                            asio::steady_timer timer(co_await asio::this_coro::executor, 1s);
//                            co_await timer.async_wait(asio::use_awaitable);
//                            co_return Response{.text = "done"};
//                          }));
//   io.stop();
#pragma once

#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <utility>

#include <boost/asio/any_io_executor.hpp>
#include <boost/asio/awaitable.hpp>
#include <boost/asio/bind_cancellation_slot.hpp>
#include <boost/asio/cancellation_signal.hpp>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/strand.hpp>

#include "services/sdk/call.hpp"

namespace millrace::services::sdk {

/// Answers a call by `co_return`; an exception becomes an error answer.
using Coroutine = std::function<boost::asio::awaitable<Response>(const Call&)>;

/// Runs `handler` for each call in a strand of its own. When the request is withdrawn, the
/// operation that the coroutine awaits is cancelled. The context of `executor` runs until the
/// service has left, and outlives it. Several calls need ServiceOptions::concurrency, but no
/// threads.
inline AsyncHandler coroutine(const boost::asio::any_io_executor& executor, Coroutine handler) {
  namespace asio = boost::asio;
  struct Cancellation {
    asio::cancellation_signal signal{};
    std::optional<std::stop_callback<std::function<void()>>> on_withdrawn{};
  };
  const auto shared = std::make_shared<const Coroutine>(std::move(handler));
  return [executor, shared](const std::shared_ptr<const Call>& call) {
    const auto strand = asio::make_strand(executor);
    asio::post(strand, [strand, shared, call] {
      const auto cancellation = std::make_shared<Cancellation>();
      asio::co_spawn(
          strand, [shared, call] { return (*shared)(*call); },
          asio::bind_cancellation_slot(
              cancellation->signal.slot(),
              [call, cancellation](const std::exception_ptr& error, Response response) {
                guarded([&](const auto&) {
                  if (error) {
                    std::rethrow_exception(error);
                  }
                  call->answer(std::move(response));
                })(call);
              }));
      const auto cancel = [weak = std::weak_ptr(cancellation)] {
        if (const auto waiting = weak.lock()) {
          waiting->signal.emit(asio::cancellation_type::all);
        }
      };
      cancellation->on_withdrawn.emplace(call->stop_token(),
                                         [strand, cancel] { asio::post(strand, cancel); });
    });
  };
}

}  // namespace millrace::services::sdk
