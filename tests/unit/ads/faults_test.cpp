#include "cnc/ads/faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using namespace std::chrono_literals;

constexpr FaultyLine::Time start(1h);

TEST(FaultyLine, DelaysEachAnswer) {
  FaultyLine sut;
  sut.push({1}, {.delay = 10ms}, start);
  sut.push({2}, {.delay = 10ms}, start + 1ms);
  EXPECT_EQ(sut.size(), 2U);
  EXPECT_EQ(sut.next_due(), start + 10ms);
  EXPECT_THAT(sut.take(start + 9ms), IsEmpty());
  EXPECT_THAT(sut.take(start + 10ms), ElementsAre(1));
  EXPECT_THAT(sut.take(start + 11ms), ElementsAre(2));
  EXPECT_EQ(sut.next_due(), std::nullopt);
  EXPECT_EQ(sut.size(), 0U);
}

TEST(FaultyLine, DropsEveryNthAnswer) {
  FaultyLine sut;
  for (std::uint8_t i = 1; i <= 6; ++i) {
    sut.push({i}, {.drop_every = 3}, start);
  }
  EXPECT_THAT(sut.take(start), ElementsAre(1, 2, 4, 5));
}

TEST(FaultyLine, ReordersAnswers) {
  FaultyLine sut;
  for (std::uint8_t i = 1; i <= 4; ++i) {
    sut.push({i}, {.delay = 10ms, .out_of_order = true}, start);
  }
  EXPECT_THAT(sut.take(start + 20ms), ElementsAre(2, 4, 1, 3));
}

}  // namespace
}  // namespace millrace::cnc::ads
