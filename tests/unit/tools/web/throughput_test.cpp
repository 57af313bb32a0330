#include "tools/web/plant/throughput.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::web::plant {
namespace {

using namespace std::chrono_literals;

constexpr fabric::SteadyTime begun{std::chrono::hours(1)};

TEST(AThroughput, IsThatOfItsWindow) {
  Throughput sut;
  for (int i = 0; i < 20; ++i) {
    sut.add(begun + i * 1s, 3ms, false);
  }
  EXPECT_DOUBLE_EQ(sut.figures(begun + 20s, begun).per_second, 1);
  EXPECT_EQ(sut.figures(begun + 20s, begun).p50, 3ms);
  EXPECT_EQ(sut.figures(begun + 60s, begun).per_second, 0);
  EXPECT_FALSE(sut.is_moving(begun + 60s));
}

TEST(AThroughput, CountsTheErrorsOfTheLastMinuteSoThatOneIsOne) {
  Throughput sut;
  sut.add(begun, 3ms, true);
  EXPECT_EQ(sut.figures(begun + 1s, begun).errors_last_minute, 1);
  EXPECT_EQ(sut.figures(begun + 59s, begun).errors_last_minute, 1);
  EXPECT_TRUE(sut.is_moving(begun + 59s)) << "its figures will change";
  EXPECT_EQ(sut.figures(begun + 61s, begun).errors_last_minute, 0);
  EXPECT_FALSE(sut.is_moving(begun + 61s));
}

}  // namespace
}  // namespace millrace::tools::web::plant
