#include "cnc/ads/discovery.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::ads {
namespace {

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

}  // namespace
}  // namespace millrace::cnc::ads
