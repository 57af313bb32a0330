#include <gtest/gtest.h>

#include "tools/bus/snapshot.hpp"

namespace millrace::tools::bus {
namespace {

using namespace std::chrono_literals;

// How long a command listens to a fabric.

class ListeningTimeTest : public testing::Test {
 protected:
  const ListeningTime::Clock::time_point start{1h};
  ListeningTime sut{{.at_least = 700ms, .quiet = 200ms, .at_most = 5s, .authentication = 3s},
                    start};
};

TEST_F(ListeningTimeTest, IsAsLongAsDiscoveryTakes) {
  sut.on_news(start + 100ms);
  sut.on_timer(start + 50ms, start + 70ms);
  EXPECT_EQ(sut.end(), start + 700ms);
}

TEST_F(ListeningTimeTest, ContinuesUntilNoNewProcessComes) {
  sut.on_news(start + 650ms);
  EXPECT_EQ(sut.end(), start + 850ms);
}

TEST_F(ListeningTimeTest, StartsAgainWhereATimerIsLateAsOnABusyHost) {
  sut.on_timer(start + 400ms, start + 421ms);
  EXPECT_EQ(sut.end(), start + 1121ms);
  sut.on_timer(start + 450ms, start + 451ms);
  EXPECT_EQ(sut.end(), start + 1121ms) << "a timer on time changes nothing";
}

TEST_F(ListeningTimeTest, WaitsForTheProofOfAnAnnouncedParticipant) {
  EXPECT_EQ(sut.end(true), start + 3s);
  EXPECT_EQ(sut.end(false), start + 700ms);
}

TEST_F(ListeningTimeTest, WaitsLongerForTheProofOnABusyHost) {
  sut.on_timer(start + 400ms, start + 421ms);
  EXPECT_EQ(sut.end(true), start + 3421ms);
}

TEST_F(ListeningTimeTest, EndsAlsoOnAHostThatIsAlwaysBusy) {
  sut.on_timer(start + 4900ms, start + 4950ms);
  sut.on_news(start + 4950ms);
  EXPECT_EQ(sut.end(), start + 5s);
}

}  // namespace
}  // namespace millrace::tools::bus
