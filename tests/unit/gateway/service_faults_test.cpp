#include "gateway/core/service_faults.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway::core {
namespace {

using fabric::AlarmLevel;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr SteadyTime now{std::chrono::hours(1)};

TEST(AnErrorSeries, IsAWarningAtThreeErrorsAndAProblemAtTen) {
  ErrorSeries sut;
  for (std::size_t errors = 1; errors < 20; ++errors) {
    const auto expected = errors == 3    ? std::optional(AlarmLevel::warning)
                          : errors == 10 ? std::optional(AlarmLevel::problem)
                                         : std::nullopt;
    EXPECT_EQ(sut.on_error("a", now), expected) << errors;
    EXPECT_EQ(sut.length("a"), errors);
  }
  EXPECT_EQ(sut.length("b"), 0);
}

TEST(AnErrorSeries, EndsWithAnotherResponse) {
  ErrorSeries sut;
  sut.on_error("a", now);
  EXPECT_FALSE(sut.on_success("a")) << "it had no alarm";
  for (int i = 0; i < 3; ++i) {
    sut.on_error("a", now);
  }
  EXPECT_FALSE(sut.on_success("b"));
  EXPECT_TRUE(sut.on_success("a"));
  EXPECT_TRUE(sut.empty());
}

TEST(AnErrorSeries, IsForgottenAWhileAfterItsLastError) {
  ErrorSeries sut;
  for (int i = 0; i < 3; ++i) {
    sut.on_error("a", now);
  }
  sut.on_error("b", now);
  EXPECT_THAT(sut.on_time(now + ErrorSeries::kept - std::chrono::seconds(1)), IsEmpty());
  EXPECT_THAT(sut.on_time(now + ErrorSeries::kept), ElementsAre("a"));
  EXPECT_TRUE(sut.empty());
}

TEST(AnErrorSeries, KeepsABoundedNumberOfServices) {
  ErrorSeries sut;
  for (std::size_t i = 0; i < 2 * ErrorSeries::most; ++i) {
    for (int error = 0; error < 3; ++error) {
      sut.on_error(std::to_string(i), now);
    }
  }
  EXPECT_EQ(sut.on_time(now + ErrorSeries::kept).size(), ErrorSeries::most);
}

}  // namespace
}  // namespace millrace::gateway::core
