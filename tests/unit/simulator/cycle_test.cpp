#include "cnc/simulator/cycle.hpp"

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "tests/support/run_until.hpp"

namespace millrace::cnc::simulator {
namespace {

using namespace std::chrono_literals;

TEST(Cycle, RunsWhileThereIsWorkAndThenSleeps) {
  boost::asio::io_context io;
  int left = 3;
  Cycle sut(io.get_executor(), 1ms, [&](auto) { return --left > 0; });
  io.run();
  EXPECT_EQ(left, 3) << "nothing runs before it is woken";
  sut.wake();
  io.restart();
  io.run();
  EXPECT_EQ(left, 0);
  EXPECT_EQ(sut.counts().done, 3);
}

TEST(Cycle, IsWokenAgain) {
  boost::asio::io_context io;
  int runs = 0;
  Cycle sut(io.get_executor(), 1ms, [&](auto) { return ++runs % 2 != 0; });
  for (int i = 0; i < 2; ++i) {
    sut.wake();
    sut.wake();
    io.restart();
    io.run();
  }
  EXPECT_EQ(runs, 4);
}

TEST(Cycle, KeepsItsPeriod) {
  boost::asio::io_context io;
  std::vector<std::chrono::nanoseconds> times;
  Cycle sut(io.get_executor(), 5ms, [&](auto now) {
    times.push_back(now);
    return times.size() < 3;
  });
  const auto start = std::chrono::steady_clock::now().time_since_epoch();
  sut.wake();
  io.run();
  // Since wake(): the first cycle may be a little late, and the later ones do not wait for it.
  EXPECT_GE(times.at(2) - start, 10ms);
}

TEST(Cycle, CountsTheCyclesThatWereLate) {
  boost::asio::io_context io;
  int runs = 0;
  Cycle sut(io.get_executor(), 1ms, [&](auto now) {
    while (runs == 0 && std::chrono::steady_clock::now().time_since_epoch() < now + 5ms) {
      // The first cycle takes too long.
    }
    return ++runs < 2;
  });
  sut.wake();
  io.run();
  EXPECT_EQ(sut.counts().done, 2);
  EXPECT_GE(sut.counts().late, 1);
  EXPECT_GE(sut.counts().worst, 4ms);
}

TEST(Cycle, RunsNoMoreOnceStopped) {
  boost::asio::io_context io;
  int runs = 0;
  Cycle sut(io.get_executor(), 1ms, [&](auto) { return ++runs > 0; });
  sut.wake();
  ASSERT_TRUE(tests::run_until(io, [&] { return runs == 2; }));
  sut.stop();
  io.restart();
  io.run();
  EXPECT_EQ(runs, 2);
}

}  // namespace
}  // namespace millrace::cnc::simulator
