#include "gateway/machines/machine_status_writer.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;

Moment at(std::chrono::seconds time) {
  return {SteadyTime(time), fabric::Time(time)};
}

using enum fabric::WatchMode;

class MachineStatusWriterTest : public testing::Test {
 protected:
  machines::MachineStatusWriter sut{fabric::MachineStatus{.machine = "cnc"}};
};

TEST_F(MachineStatusWriterTest, ReportsSinceWhenTheLinkIsUp) {
  sut.on_down("connecting", at(1s));
  sut.on_up(2, polled, "", at(5s));
  sut.on_up(1, pushed, "channel 2 is served by another", at(7s));
  const auto news = sut.take_change();
  ASSERT_TRUE(news);
  EXPECT_TRUE(news->connected);
  EXPECT_EQ(news->since, fabric::Time(5s));
  EXPECT_EQ(news->channels, 1);
  EXPECT_EQ(news->watch, pushed);
  EXPECT_EQ(news->reason, "channel 2 is served by another");
}

TEST_F(MachineStatusWriterTest, ReportsWhyTheLinkIsDownAndSinceWhen) {
  sut.on_up(2, polled, "", at(1s));
  sut.on_down("connection reset", at(5s));
  sut.on_down("connection refused", at(6s));
  const auto news = sut.take_change();
  ASSERT_TRUE(news);
  EXPECT_FALSE(news->connected);
  EXPECT_EQ(news->since, fabric::Time(5s));
  EXPECT_EQ(news->reason, "connection refused");
  EXPECT_EQ(news->channels, 0);
  EXPECT_EQ(news->watch, none);
}

TEST_F(MachineStatusWriterTest, ReportsEachStateOnce) {
  sut.on_up(2, polled, "", at(1s));
  EXPECT_TRUE(sut.take_change());
  EXPECT_FALSE(sut.take_change());
  sut.on_up(2, polled, "", at(3s));
  EXPECT_FALSE(sut.take_change());
}

TEST_F(MachineStatusWriterTest, CountsRequestsAndTheTimeUntilTheirAnswers) {
  sut.on_load({.requests = 100, .answered = 100, .waited = 5s}, at(1s).steady);
  sut.on_load({.requests = 300, .answered = 200, .waited = 6s}, at(3s).steady);
  EXPECT_EQ(sut.status().requests_per_second, 100U);
  EXPECT_EQ(sut.status().round_trip, 10ms);
}

TEST_F(MachineStatusWriterTest, StartsOverWithANewLink) {
  sut.on_load({.requests = 100, .answered = 100, .waited = 5s}, at(1s).steady);
  sut.on_load({.requests = 10, .answered = 10, .waited = 10ms}, at(2s).steady);
  EXPECT_EQ(sut.status().requests_per_second, 10U);
  EXPECT_EQ(sut.status().round_trip, 1ms);
}

TEST_F(MachineStatusWriterTest, ShowsNoRoundTripWithoutAnAnswer) {
  sut.on_load({}, at(1s).steady);
  sut.on_load({.requests = 4}, at(2s).steady);
  EXPECT_EQ(sut.status().round_trip, 0ns);
}

}  // namespace
}  // namespace millrace::gateway
