#include "cnc/simulator/service_interface.hpp"

#include <optional>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

#include "cnc/simulator/cycle.hpp"
#include "tests/support/wait_for.hpp"

namespace millrace::cnc::simulator {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

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

// The duration of a service call, as its NC program sees it; and writes of ADS clients that take
// effect later. service_interface.scenario has the kernel's other rules.

class Timing : public testing::Test {
 protected:
  void program_writes(const char* name, nc::Value value) {
    ASSERT_TRUE(globals_.find(name)->assign(Variable::scalar, value));
  }
  void client_writes(const char* name, std::uint8_t value) {
    ASSERT_TRUE(globals_.find(name)->write(Variable::scalar, ads::Bytes{value, 0, 0, 0}));
  }

  nanoseconds now_{0};
  std::vector<AnsweredCall> calls_;
  Family globals_;
  ServiceInterface sut_{globals_,
                        {},
                        [this] { return now_; },
                        [this](const AnsweredCall& call) { calls_.push_back(call); }};
};

TEST_F(Timing, RunsFromTheRequestToTheFirstResponse) {
  program_writes("V.G.SERVICE.UUID", "a-uuid");
  now_ = milliseconds(10);
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(12);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 5);
  now_ = milliseconds(20);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 6);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].number, 1);
  EXPECT_EQ(calls_[0].uuid, "a-uuid");
  EXPECT_EQ(calls_[0].duration, milliseconds(2));
}

TEST_F(Timing, StartsAgainWithEachRequest) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(5);
  program_writes("V.G.SERVICE.REQUEST_STATE", 2.0);
  now_ = milliseconds(6);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].duration, milliseconds(1));
}

TEST_F(Timing, ForgetsARequestThatWasWithdrawn) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  program_writes("V.G.SERVICE.REQUEST_STATE", 0.0);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  EXPECT_TRUE(calls_.empty());
}

TEST_F(Timing, ForgetsARequestThatWasReset) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  sut_.reset();
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  EXPECT_TRUE(calls_.empty());
}

TEST_F(Timing, ContinuesWhenTheClientWithdrawsTheRequestFirst) {
  program_writes("V.G.SERVICE.REQUEST_STATE", 1.0);
  now_ = milliseconds(3);
  client_writes("V.G.SERVICE.REQUEST_STATE", 0);
  client_writes("V.G.SERVICE.RESPONSE_STATE", 1);
  ASSERT_EQ(calls_.size(), 1);
  EXPECT_EQ(calls_[0].duration, milliseconds(3));
}

class LateWrites : public testing::Test {
 protected:
  void start(ServiceRules rules) {
    sut_.emplace(
        globals_, rules, [this] { return now_; }, [](const AnsweredCall&) {});
    ASSERT_TRUE(globals_.find("V.G.SERVICE.REQUEST_STATE")->assign(Variable::scalar, 1.0));
  }
  void client_writes(const char* name, std::uint8_t value) {
    ASSERT_TRUE(globals_.find(name)->write(Variable::scalar, ads::Bytes{value, 0, 0, 0}));
  }
  nc::Value value(const char* name) { return globals_.find(name)->value(Variable::scalar); }
  void move_to(milliseconds time) {
    now_ = time;
    sut_->advance(now_);
  }

  nanoseconds now_{0};
  Family globals_;
  std::optional<ServiceInterface> sut_;
};

TEST_F(LateWrites, TakeEffectInTheirOrderAfterADelay) {
  start({.writes_visible_after = milliseconds(10)});
  client_writes("V.G.SERVICE.REQUEST_STATE", 0);
  move_to(milliseconds(5));
  client_writes("V.G.SERVICE.RESPONSE_STATE", 7);
  move_to(milliseconds(9));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(1.0));
  move_to(milliseconds(10));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(0.0));
  EXPECT_EQ(value("V.G.SERVICE.RESPONSE_STATE"), nc::Value(0.0));
  move_to(milliseconds(15));
  EXPECT_EQ(value("V.G.SERVICE.RESPONSE_STATE"), nc::Value(7.0));
}

TEST_F(LateWrites, DoNotDelayTheProgram) {
  start({.writes_visible_after = milliseconds(10)});
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(1.0));
}

TEST_F(LateWrites, Of0AreIgnoredByAKernelThatClearsRequestStateItself) {
  start({.kernel_clears_after = milliseconds(10)});
  client_writes("V.G.SERVICE.REQUEST_STATE", 0);
  move_to(milliseconds(100));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(1.0));
  client_writes("V.G.SERVICE.RESPONSE_STATE", 7);
  move_to(milliseconds(109));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(1.0));
  move_to(milliseconds(110));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(0.0));
}

TEST_F(LateWrites, OfSuchAKernelLeaveTheProgramsNextRequestAlone) {
  start({.kernel_clears_after = milliseconds(10)});
  client_writes("V.G.SERVICE.RESPONSE_STATE", 7);
  move_to(milliseconds(5));
  ASSERT_TRUE(globals_.find("V.G.SERVICE.REQUEST_STATE")->assign(Variable::scalar, 2.0));
  move_to(milliseconds(20));
  EXPECT_EQ(value("V.G.SERVICE.REQUEST_STATE"), nc::Value(2.0));
}

}  // namespace
}  // namespace millrace::cnc::simulator
