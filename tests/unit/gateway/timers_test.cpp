#include "gateway/core/timers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway::core {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

class TimersOfChannels : public testing::Test {
 protected:
  const SteadyTime start{1h};
  const fabric::ChannelKey first{"cnc", 1};
  const fabric::ChannelKey second{"cnc", 2};
  Timers sut;
};

TEST_F(TimersOfChannels, AreDueOnceInTheOrderOfTheirTimes) {
  sut.set(first, start + 2s);
  sut.set(second, start + 1s);
  EXPECT_EQ(sut.next(), start + 1s);
  EXPECT_THAT(sut.take_due(start), IsEmpty());
  EXPECT_THAT(sut.take_due(start + 2s), ElementsAre(second, first));
  EXPECT_THAT(sut.take_due(start + 2s), IsEmpty());
  EXPECT_EQ(sut.next(), std::nullopt);
}

TEST_F(TimersOfChannels, AreDueEarlierIfTheyAreSetEarlier) {
  sut.set(first, start + 2s);
  sut.set(first, start + 1s);
  EXPECT_EQ(sut.next(), start + 1s);
  EXPECT_THAT(sut.take_due(start + 1s), ElementsAre(first));
  EXPECT_EQ(sut.next(), std::nullopt);
}

TEST_F(TimersOfChannels, AreLeftWhereTheyStandIfTheyAreSetLater) {
  sut.set(first, start + 1s);
  sut.set(first, start + 2s);
  EXPECT_THAT(sut.take_due(start + 1s), ElementsAre(first));
  sut.set(first, start + 2s);
  EXPECT_EQ(sut.next(), start + 2s);
}

TEST_F(TimersOfChannels, AreDueInOneOrderAtOneTime) {
  sut.set(second, start);
  sut.set(first, start);
  EXPECT_THAT(sut.take_due(start), ElementsAre(first, second));
}

TEST_F(TimersOfChannels, AreNotDueOnceTheChannelIsRemoved) {
  sut.set(first, start);
  sut.remove(first);
  sut.remove(second);
  EXPECT_EQ(sut.next(), std::nullopt);
  EXPECT_THAT(sut.take_due(start), IsEmpty());
}

}  // namespace
}  // namespace millrace::gateway::core
