#include "cnc/ads/connect_info.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::HasSubstr;

Bytes vector(const std::string& name) {
  return tests::hex_vector("ads/connect_info.hex", name);
}

std::string mistake_in(const Bytes& bytes) {
  const auto info = decode_connect_info(bytes);
  return info ? "no error" : info.error().message;
}

TEST(ConnectInfo, OfAKnownClientIs64Bytes) {
  const ConnectInfo sut{.net_id = {{192, 168, 10, 20, 1, 1}}, .host = "GATEWAY"};
  EXPECT_EQ(encode(sut), vector("known_client"));
  EXPECT_EQ(*decode_connect_info(vector("known_client")), sut);
}

TEST(ConnectInfo, ThatAddsARouteEndsWithUserAndPassword) {
  using namespace connect_flags;
  const ConnectInfo sut{.flags = add_route | ignore_common_name | ip_address | self_signed,
                        .net_id = {{192, 168, 10, 20, 1, 1}},
                        .host = "GATEWAY",
                        .user = "Administrator",
                        .password = "1"};
  EXPECT_EQ(encode(sut), vector("adds_a_route"));
  EXPECT_EQ(*decode_connect_info(vector("adds_a_route")), sut);
}

TEST(ConnectInfo, OfAControllerHasTheReasonOfARefusal) {
  const auto sut = decode_connect_info(vector("unknown_certificate"));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->flags, connect_flags::response);
  EXPECT_EQ(describe(sut->error), "error 3, unknown certificate");
  EXPECT_EQ(sut->net_id.to_string(), "192.168.10.5.1.1");
}

TEST(ConnectInfo, CutsAHostNameThatIsTooLong) {
  const auto sut = decode_connect_info(encode({.host = std::string(40, 'h')}));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->host, std::string(32, 'h'));
}

TEST(ConnectInfo, IsRefusedIfItsLengthsDoNotAgree) {
  Bytes bytes = vector("known_client");
  bytes[0] = 63;
  EXPECT_THAT(mistake_in(bytes), HasSubstr("63 bytes; expected 64 to 512"));
  bytes[0] = 65;
  EXPECT_THAT(mistake_in(bytes), HasSubstr("says 65 bytes"));
  bytes = vector("adds_a_route");
  bytes[13] = 200;
  EXPECT_THAT(mistake_in(bytes), HasSubstr("213 of them texts"));
  EXPECT_THAT(mistake_in(Bytes(64, 0xA5)), HasSubstr("of 42405 bytes"));
  EXPECT_THAT(mistake_in({}), HasSubstr("of 0 bytes"));
}

}  // namespace
}  // namespace millrace::cnc::ads
