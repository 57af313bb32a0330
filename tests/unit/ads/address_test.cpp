#include "cnc/ads/address.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::ads {
namespace {

TEST(NetId, IsSixNumbersWithDots) {
  const auto sut = NetId::parse("5.62.130.0.1.255");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->bytes, (std::array<std::uint8_t, 6>{5, 62, 130, 0, 1, 255}));
  EXPECT_EQ(sut->to_string(), "5.62.130.0.1.255");
}

TEST(NetId, IsNothingElse) {
  for (const auto* text :
       {"", "1.2.3.4.5", "1.2.3.4.5.6.7", "1.2.3.4.5.256", "1.2.3.4.5.", "1.2.3.4.5.x",
        " 1.2.3.4.5.6", "1.2.3.4.5.6 ", "1..3.4.5.6", "1.2.3.4.5.-6", "host"}) {
    EXPECT_FALSE(NetId::parse(text)) << text;
  }
}

TEST(AmsAddress, IsWrittenAsNetIdAndPort) {
  EXPECT_EQ((Address{*NetId::parse("127.0.0.1.1.1"), 552}).to_string(), "127.0.0.1.1.1:552");
}

}  // namespace
}  // namespace millrace::cnc::ads
