#include <gtest/gtest.h>

#include "services/archiver/archive.hpp"

namespace millrace::services::archiver {
namespace {

using namespace std::chrono_literals;

const fabric::Time start{};
const Policy policy{.rotate_bytes = 100, .rotate_age = 24h, .keep_age = 240h, .keep_bytes = 1000};

TEST(Rotation, IsDueWhenAFileIsLargeOrOld) {
  EXPECT_FALSE(must_rotate(policy, start, 99, start + 23h));
  EXPECT_TRUE(must_rotate(policy, start, 100, start));
  EXPECT_TRUE(must_rotate(policy, start, 0, start + 24h));
}

TEST(Rotation, IsNeverDueWithoutLimits) {
  EXPECT_FALSE(must_rotate({.rotate_bytes = 0, .rotate_age = 0h}, start, 1'000'000, start + 9999h));
}

TEST(Retention, RemovesWhatIsTooOld) {
  const std::vector<Closed> closed{{10, start}, {10, start + 100h}, {10, start + 200h}};
  EXPECT_EQ(expired(policy, closed, 10, start + 239h), 0U);
  EXPECT_EQ(expired(policy, closed, 10, start + 240h), 1U);
  EXPECT_EQ(expired(policy, closed, 10, start + 340h), 2U);
}

TEST(Retention, RemovesTheOldestOfTooMuch) {
  const std::vector<Closed> closed{{400, start}, {400, start}, {400, start}};
  EXPECT_EQ(expired(policy, closed, 100, start), 1U);
  EXPECT_EQ(expired(policy, closed, 700, start), 2U);
}

TEST(Retention, KeepsWhatHasNoKnownAge) {
  const std::vector<Closed> closed{{10, std::nullopt}, {10, start}, {10, start}};
  EXPECT_EQ(expired(policy, closed, 10, start + 9999h), 0U);
}

TEST(Rotation, IsDueForAFileOfAClockThatWasAhead) {
  EXPECT_FALSE(must_rotate(policy, start + 23h, 0, start));
  EXPECT_TRUE(must_rotate(policy, start + 8760h, 0, start));
}

TEST(Retention, KeepsTheNewestClosedFileInAnyCase) {
  EXPECT_EQ(expired(policy, {{5000, start}}, 10, start + 9999h), 0U);
  EXPECT_EQ(expired(policy, {}, 5000, start), 0U);
}

TEST(Retention, RemovesNothingWithoutLimits) {
  const Policy unlimited{.keep_age = 0h, .keep_bytes = 0};
  EXPECT_EQ(expired(unlimited, {{5000, start}, {5000, start}}, 10, start + 99999h), 0U);
}

}  // namespace
}  // namespace millrace::services::archiver
