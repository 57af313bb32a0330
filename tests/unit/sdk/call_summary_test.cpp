#include <gtest/gtest.h>

#include "services/sdk/instance.hpp"

namespace millrace::services::sdk {
namespace {

using namespace std::chrono_literals;

TEST(CallSummary, CountsTheCallsSinceTheLastOne) {
  const fabric::InstanceStatus before{.answered = 1000, .failed = 4, .cancelled = 1};
  const fabric::InstanceStatus now{.answered = 61'000, .failed = 6, .cancelled = 1};
  EXPECT_EQ(call_summary(before, now, 60s), "60000 calls answered in 60 s, 2 with an error");
}

TEST(CallSummary, CountsCallsWithoutAnAnswerToo) {
  const fabric::InstanceStatus now{
      .running = 1, .answered = 1, .repeated = 2, .cancelled = 3, .declined = 4};
  EXPECT_EQ(
      call_summary({}, now, 7s),
      "1 call answered in 7 s, 2 again from memory, 3 withdrawn, 4 declined, 1 still running");
}

TEST(CallSummary, IsAbsentAfterAQuietMinute) {
  const fabric::InstanceStatus now{.running = 1, .answered = 7};
  EXPECT_EQ(call_summary(now, now, 60s), std::nullopt);
}

}  // namespace
}  // namespace millrace::services::sdk
