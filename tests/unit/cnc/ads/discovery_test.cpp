#include "cnc/ads/discovery.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/connect_info.hpp"
#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::HasSubstr;

Bytes datagram(const std::string& name) {
  return tests::hex_vector("ads/discovery.hex", name);
}

TEST(Discovery, SendsAnIdentifyRequestWithoutTags) {
  EXPECT_EQ(encode(identify_request(7)), datagram("identify"));
}

TEST(Discovery, ReadsTheIdentityOfAController) {
  const auto sut = identity_of(*decode_datagram(datagram("identity")));
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->net_id.to_string(), "192.168.10.5.1.1");
  EXPECT_EQ(sut->name, "CX-123456");
  EXPECT_EQ(sut->twincat, "3.1.4024");
  EXPECT_EQ(sut->system, "Windows NT 10.0.19041");
  EXPECT_EQ(sut->fingerprint, "abcd");
}

TEST(Discovery, LeavesMissingFieldsEmpty) {
  const Datagram silent{7, DiscoveryService::identify, true, {{{10, 0, 0, 1, 1, 1}}, 10000}};
  const auto sut = identity_of(*decode_datagram(encode(silent)));
  Identity expected;
  expected.net_id = {{10, 0, 0, 1, 1, 1}};
  EXPECT_EQ(sut, expected);
}

TEST(Discovery, RequestsARoute) {
  const RouteRequest sut{
      {{192, 168, 10, 20, 1, 1}}, "gateway", "192.168.10.20", "Admin", "1", true};
  EXPECT_EQ(encode(encode(8, sut)), datagram("add_route"));
  EXPECT_EQ(route_request_of(*decode_datagram(datagram("add_route"))), sut);
}

TEST(Discovery, ReadsWhetherARouteWasAdded) {
  const auto sut = decode_datagram(datagram("route_refused"));
  EXPECT_EQ(route_status_of(*sut), ErrorCode::access_denied_index);
  EXPECT_EQ(route_status_of(identify_request(7)), std::nullopt);
  EXPECT_EQ(identity_of(*sut), std::nullopt);
}

TEST(Discovery, RefusesWhatIsNoMessageOfARouter) {
  EXPECT_FALSE(decode_datagram({}));
  EXPECT_FALSE(decode_datagram(Bytes(24, 0)));
  Bytes cut = datagram("identity");
  cut.pop_back();
  EXPECT_FALSE(decode_datagram(cut));
  Bytes many = datagram("identify");
  many[22] = 0xFF;
  EXPECT_FALSE(decode_datagram(many));
}

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
