#include "services/lcm/complaints.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::services::lcm {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

const fabric::SteadyTime start{1h};

TEST(Complaints, AreSaidOnceAndThenCounted) {
  Complaints sut;
  EXPECT_EQ(sut.note("forged", "a", "first", start), "first");
  for (int i = 0; i < 20'000; ++i) {
    EXPECT_EQ(sut.note("forged", "a", "again", start + 1s), std::nullopt);
  }
  EXPECT_EQ(sut.note("forged", "b", "other", start + 1s), "other");
  EXPECT_THAT(sut.due(start + 59s), IsEmpty());
  EXPECT_THAT(sut.due(start + 60s), ElementsAre("again (and 19999 more like this in 60 s)"));
  EXPECT_THAT(sut.due(start + 61s), IsEmpty());
}

TEST(Complaints, AreNewOnceTheyHaveNotComeForLong) {
  Complaints sut;
  static_cast<void>(sut.note("forged", "a", "first", start));
  EXPECT_THAT(sut.due(start + 60s), IsEmpty());
  EXPECT_EQ(sut.note("forged", "a", "again", start + 61s), "again");
}

TEST(Complaints, OfTooManyKindsAreCountedTogether) {
  Complaints sut;
  for (std::size_t i = 0; i < Complaints::most_kinds; ++i) {
    EXPECT_TRUE(sut.note("kind", std::to_string(i), "text", start));
  }
  EXPECT_EQ(sut.note("kind", "x", "one too many", start),
            "one too many; more is wrong than is told one by one");
  EXPECT_EQ(sut.note("kind", "y", "two too many", start), std::nullopt);
  EXPECT_THAT(sut.due(start + 60s), ElementsAre("1 messages were wrong in other ways in 60 s"));
}

}  // namespace
}  // namespace millrace::services::lcm
