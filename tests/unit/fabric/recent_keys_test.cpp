#include "fabric/recent_keys.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

RequestKey key(std::uint64_t epoch, std::uint16_t channel = 1) {
  return {{.machine = "cnc", .channel = channel}, epoch};
}

TEST(RecentKeysTest, ForgetsTheLeastRecentlyUsedKey) {
  RecentKeys sut(2);
  EXPECT_EQ(sut.use(key(1)), std::nullopt);
  EXPECT_EQ(sut.use(key(2)), std::nullopt);
  EXPECT_EQ(sut.use(key(1)), std::nullopt);
  EXPECT_EQ(sut.use(key(3)), key(2));
  EXPECT_EQ(sut.use(key(1)), std::nullopt);
  EXPECT_EQ(sut.use(key(2)), key(3));
}

TEST(RecentKeysTest, SeparatesChannelsAndGateways) {
  RecentKeys sut(2);
  sut.use(key(1, 1));
  EXPECT_EQ(sut.use(key(1, 2)), std::nullopt);
  EXPECT_EQ(sut.use(key(2, 1)), key(1, 1));
}

}  // namespace
}  // namespace millrace::fabric
