#include "services/sdk/asio.hpp"

#include <atomic>
#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/this_coro.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <gtest/gtest.h>

#include "services/sdk/testing/loopback.hpp"
#include "tests/support/await.hpp"

namespace millrace::services::sdk {
namespace {

namespace asio = boost::asio;
using sdk::testing::FakeCall;
using sdk::testing::Loopback;

constexpr const char* uuid = "b0ad2ab8-5e5c-4c8c-9b0b-0f6f0a1c2d3e";

/// Long enough for every test: only its cancellation ends it.
asio::awaitable<void> pause() {
  asio::steady_timer timer(co_await asio::this_coro::executor, std::chrono::hours(1));
  co_await timer.async_wait(asio::use_awaitable);
}

class AnAsioCoroutine : public ::testing::Test {
 protected:
  ~AnAsioCoroutine() override {
    if (io) {
      io->stop();
    }
  }

  AsyncHandler sut(Coroutine handler) { return coroutine(io->get_executor(), std::move(handler)); }

  std::optional<asio::io_context> io{std::in_place};
  asio::executor_work_guard<asio::io_context::executor_type> work = asio::make_work_guard(*io);
  std::jthread thread{[this] { io->run(); }};
};

TEST_F(AnAsioCoroutine, AnswersFromTheContextOfTheProgram) {
  std::thread::id seen;
  const auto reply =
      FakeCall({.text = "hello"}).run(sut([&](const Call& call) -> asio::awaitable<Response> {
        seen = std::this_thread::get_id();
        co_return Response{.text = call.text(), .state = 7};
      }));
  EXPECT_EQ(reply->text, "hello");
  EXPECT_EQ(reply->state, 7U);
  EXPECT_EQ(seen, thread.get_id());
}

TEST_F(AnAsioCoroutine, GetsAnErrorResponseForAnException) {
  FakeCall call;
  const auto reply = call.run(sut([](const Call& own) -> asio::awaitable<Response> {
    own.interim({"begun", 50});
    co_await asio::post(asio::use_awaitable);
    throw std::runtime_error("no gauge");
  }));
  EXPECT_EQ(reply->text, "ERROR: no gauge");
  EXPECT_EQ(reply->code, fabric::ServiceCode::failed);
  EXPECT_EQ(call.interims().size(), 1U);
}

TEST_F(AnAsioCoroutine, AwaitsBesideOthersInOneThread) {
  int waiting = 0;  // of the thread of the context
  asio::steady_timer all(*io, asio::steady_timer::time_point::max());
  Loopback loopback;
  loopback.start({.uuid = uuid, .concurrency = 3},
                 sut([&](const Call& call) -> asio::awaitable<Response> {
                   if (++waiting == 3) {
                     asio::post(*io, [&] { all.cancel(); });
                   }
                   boost::system::error_code cancelled;
                   co_await all.async_wait(asio::redirect_error(asio::use_awaitable, cancelled));
                   co_return Response{.text = call.text()};
                 }));
  auto first = loopback.send({.uuid = uuid, .text = "1"});
  auto second = loopback.send({.uuid = uuid, .text = "2"});
  auto third = loopback.send({.uuid = uuid, .text = "3"});
  EXPECT_EQ(first.wait()->text, "1");
  EXPECT_EQ(second.wait()->text, "2");
  EXPECT_EQ(third.wait()->text, "3");
}

TEST_F(AnAsioCoroutine, IsCancelledWithItsCall) {
  std::atomic<bool> cancelled = false;
  Loopback loopback;
  loopback.start({.uuid = uuid}, sut([&](const Call& call) -> asio::awaitable<Response> {
                   call.interim({"begun", 50});
                   try {
                     co_await pause();
                   } catch (const boost::system::system_error& error) {
                     cancelled = error.code() == asio::error::operation_aborted;
                     throw;
                   }
                   co_return Response{};
                 }));
  auto pending = loopback.send({.uuid = uuid});
  tests::await("the handler", [&] { return !pending.interims().empty(); });
  pending.withdraw();
  auto next = loopback.send({.uuid = uuid});
  tests::await("room for the next call", [&] { return next.attempt() == 1; });
  EXPECT_TRUE(cancelled);
  EXPECT_EQ(pending.replies(), 0U);
}

TEST_F(AnAsioCoroutine, IsCancelledAlsoIfItsCallWasWithdrawnBeforeItBegan) {
  FakeCall call;
  call.cancel();
  EXPECT_FALSE(call.run(sut([](const Call&) -> asio::awaitable<Response> {
    co_await pause();
    co_return Response{};
  })));
}

TEST_F(AnAsioCoroutine, GetsAnErrorResponseWhenItsContextEnds) {
  Loopback loopback;
  loopback.start({.uuid = uuid}, sut([](const Call& call) -> asio::awaitable<Response> {
                   call.interim({"begun", 50});
                   co_await pause();
                   co_return Response{};
                 }));
  auto pending = loopback.send({.uuid = uuid});
  tests::await("the handler", [&] { return !pending.interims().empty(); });
  io->stop();
  thread.join();
  work.reset();
  io.reset();
  EXPECT_EQ(pending.wait()->text, "ERROR: the service dropped the call without an answer");
}

}  // namespace
}  // namespace millrace::services::sdk
