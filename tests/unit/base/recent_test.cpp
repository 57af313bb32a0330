#include "base/recent.hpp"

#include <string>

#include <gtest/gtest.h>

namespace millrace::base {
namespace {

TEST(Recent, ForgetsTheEntryThatWasUnusedForLongest) {
  Recent<int, std::string> sut(2);
  EXPECT_FALSE(sut.put(1, "one"));
  EXPECT_FALSE(sut.put(2, "two"));
  EXPECT_EQ(*sut.use(1), "one");
  const auto displaced = sut.put(3, "three");
  ASSERT_TRUE(displaced);
  EXPECT_EQ(displaced->value, "two");
  EXPECT_EQ(sut.newest(), "three");
  EXPECT_FALSE(sut.put(1, "another one"));
  EXPECT_EQ(sut.put(4)->key, 3);
  EXPECT_EQ(*sut.find(1), "another one");
}

TEST(Recent, FindsWithoutMakingAnEntryNewer) {
  Recent<int, int, std::hash<int>> sut(2);
  sut.put(1);
  sut.put(2);
  EXPECT_NE(sut.find(1), nullptr);
  EXPECT_EQ(sut.put(3)->key, 1);
  EXPECT_EQ(sut.find(1), nullptr);
}

TEST(Recent, HasRoomForAnotherEntryAfterOneWasErased) {
  Recent<int> sut(2);
  sut.put(1);
  sut.put(2);
  sut.erase(1);
  EXPECT_FALSE(sut.put(3));
  sut.erase_if([](const auto& entry) { return entry.key == 3; });
  EXPECT_EQ(sut.size(), 1U);
  EXPECT_EQ(sut.begin()->key, 2);
}

}  // namespace
}  // namespace millrace::base
