#include "gateway/live/channel_timer.hpp"

#include <optional>

#include <boost/asio/io_context.hpp>
#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;

struct WakeUpTest : testing::Test {
  boost::asio::io_context loop;
  std::optional<live::ChannelTimer> sut{std::in_place, loop.get_executor()};
  SteadyTime past = std::chrono::steady_clock::now();
  int rung = 0;
  void set(SteadyTime at) {
    sut->set(at, [this] { ++rung; });
  }
};

TEST_F(WakeUpTest, RingsOnce) {
  set(past);
  set(past + 1h);
  loop.run();
  EXPECT_EQ(rung, 1) << "what is asked for later is asked for again when it rings";
}

TEST_F(WakeUpTest, RingsEarlierIfItIsAskedTo) {
  set(past + 1h);
  set(past);
  loop.run_for(10s);
  EXPECT_EQ(rung, 1);
}

TEST_F(WakeUpTest, CanBeSetAgainOnceItHasRung) {
  set(past);
  loop.run();
  set(past);
  loop.restart();
  loop.run();
  EXPECT_EQ(rung, 2);
}

// A channel that was hidden in the same turn in which its time had come.
TEST_F(WakeUpTest, IsSilentOnceItIsGoneAlsoIfItsTimeHasCome) {
  boost::asio::steady_timer before(loop, past - 1s);
  before.async_wait([this](boost::system::error_code) { sut.reset(); });
  set(past);
  loop.run();
  EXPECT_EQ(rung, 0);
}

}  // namespace
}  // namespace millrace::gateway
