#include "gateway/machines/claims.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::gateway {
namespace {

using namespace std::chrono_literals;
using testing::IsNull;
using testing::NotNull;

fabric::InstanceId gateway(std::uint8_t number) {
  fabric::InstanceId id;
  id.bytes.fill(number);
  return id;
}

fabric::Time at(std::chrono::seconds time) {
  return machines::Claims::earliest + time;
}

fabric::MachineStatus claim(std::uint8_t number, std::chrono::seconds since,
                            std::vector<std::uint16_t> channels = {}) {
  fabric::MachineStatus status;
  status.machine = "cnc";
  status.gateway = gateway(number);
  status.claimed = at(since);
  status.claims = std::move(channels);
  status.host = "host7";
  status.pid = 4711;
  status.epoch = 0x5f3a9c0112d4;
  return status;
}

class ClaimsTest : public testing::Test {
 protected:
  machines::Claims sut{gateway(5)};
};

TEST_F(ClaimsTest, LetTheEarlierGatewayServe) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(11s)), NotNull());
}

TEST_F(ClaimsTest, DecideBetweenTwoOfOneMomentByTheirIds) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(10s)), NotNull());
  sut.remove("cnc", gateway(1));
  sut.set(claim(9, 10s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(10s)), IsNull());
}

TEST_F(ClaimsTest, ConcernTheChannelsTheyNameOrAll) {
  sut.set(claim(1, 1s, {2}));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_before({"cnc", 2}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_before({"press", 2}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, CoverAMachineOnlyIfTheyCoverAllRequestedChannels) {
  sut.set(claim(1, 1s, {1, 2}));
  EXPECT_THAT(sut.owner_of_all_before("cnc", {2}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {2, 3}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(9s)), NotNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(0s)), IsNull());
}

TEST_F(ClaimsTest, AreVoidOnceTheirGatewayIsGone) {
  sut.set(claim(1, 1s));
  EXPECT_TRUE(sut.contested("cnc"));
  sut.remove("cnc", gateway(1));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, OfOthersStandWhenAGatewayIsGone) {
  sut.set(claim(1, 1s));
  sut.set(claim(2, 2s));
  sut.remove("cnc", gateway(1));
  EXPECT_TRUE(sut.contested("cnc"));
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, OfOurOwnAreIgnored) {
  sut.set(claim(5, 1s));
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, ComeAfterServingGatewaysWhateverTheClocks) {
  sut.set(claim(1, 60s));
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(5s));
  auto serving = claim(2, 50s);
  serving.connected = true;
  sut.set(serving);
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(50s) + 1ns);
  EXPECT_EQ(sut.after_owners("cnc", at(55s)), at(55s));
}

// Regressions: one such sample stopped a machine, and the other one made the next gateway wait for
// ever.
TEST_F(ClaimsTest, OfImpossibleTimesAreIgnored) {
  using Accepted = machines::Claims::Accepted;
  for (const auto time : {fabric::Time(1ns), fabric::Time::min(), fabric::Time::max()}) {
    auto liar = claim(1, 10s);
    EXPECT_EQ(sut.set(liar), Accepted::yes);
    liar.claimed = time;
    liar.connected = true;
    EXPECT_EQ(sut.set(liar), Accepted::implausible);
    EXPECT_THAT(sut.owner_before({"cnc", 1}, at(11s)), IsNull());
    EXPECT_THAT(sut.owner_of_all_before("cnc", {}, at(11s)), IsNull());
    EXPECT_EQ(sut.after_owners("cnc", at(5s)), at(5s));
    EXPECT_FALSE(sut.contested("cnc"));
  }
}

TEST_F(ClaimsTest, HavePlausibleTimesWhateverOurClock) {
  EXPECT_EQ(machines::plausible(fabric::Time(1h)), machines::Claims::earliest);
  EXPECT_EQ(machines::plausible(fabric::Time::max()), machines::Claims::latest);
  EXPECT_EQ(machines::plausible(at(7s)), at(7s));
  auto last = claim(1, 0s);
  last.claimed = machines::Claims::latest;
  last.connected = true;
  sut.set(last);
  EXPECT_EQ(sut.after_owners("cnc", at(5s)), machines::Claims::latest);
}

TEST_F(ClaimsTest, OfAnotherControllerOfTheSameNameHaveNoEffect) {
  using Accepted = machines::Claims::Accepted;
  sut.set_address("cnc", "10.0.0.7:48898, 10.0.0.7.1.1");
  auto namesake = claim(1, 1s);
  namesake.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  namesake.connected = true;
  EXPECT_EQ(sut.set(namesake), Accepted::another_controller);
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.owner_of_all_before("cnc", {1}, at(9s)), IsNull());
  EXPECT_FALSE(sut.contested("cnc"));
  EXPECT_EQ(sut.after_owners("cnc", at(0s)), at(0s));
  EXPECT_TRUE(sut.is_elsewhere("cnc", namesake.epoch));
  namesake.address = "gate:48898, 10.0.0.7.1.1";
  EXPECT_EQ(sut.set(namesake), Accepted::yes) << "another way to the same controller";
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

// The address is relative to its own host; without a host name, it may be the same controller.
TEST_F(ClaimsTest, CountWhereTheControllerIsUnknown) {
  sut.set_address("cnc", "10.0.0.7:48898, 10.0.0.7.1.1");
  for (const char* address : {"", "nonsense", "127.0.0.1:48898, 127.0.0.1.1.1", "a, b"}) {
    auto other = claim(1, 1s);
    other.address = address;
    sut.set(other);
    EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull()) << address;
  }
}

TEST_F(ClaimsTest, CountWhereOurOwnControllerIsKnownByItsHostOnly) {
  sut.set_address("cnc", "127.0.0.1:48898, 127.0.0.1.1.1");
  auto other = claim(1, 1s);
  other.address = "10.0.0.8:48898, 10.0.0.8.1.1";
  EXPECT_EQ(sut.set(other), machines::Claims::Accepted::yes);
  EXPECT_THAT(sut.owner_before({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, AreLimitedInNumber) {
  using Accepted = machines::Claims::Accepted;
  sut.set_address("cnc", "");
  std::size_t taken = 0;
  for (int i = 0; i < 3000; ++i) {
    auto one = claim(1, 1s);
    one.machine = "machine" + std::to_string(i);
    taken += sut.set(one) == Accepted::yes ? 1U : 0U;
  }
  EXPECT_EQ(taken, machines::Claims::most_machines);
  taken = 0;
  for (int i = 0; i < 3000; ++i) {
    auto one = claim(1, 1s);
    one.gateway.bytes[0] = static_cast<std::uint8_t>(i);
    one.gateway.bytes[1] = static_cast<std::uint8_t>(i / 256);
    taken += sut.set(one) == Accepted::yes ? 1U : 0U;
  }
  EXPECT_EQ(taken, machines::Claims::most_gateways) << "ours leave room for others";
  // When one is gone there is room for one more; there is always room for ours.
  sut.remove("machine0", gateway(1));
  sut.remove("machine1", gateway(1));
  auto next = claim(1, 1s);
  next.machine = "next";
  EXPECT_EQ(sut.set(next), Accepted::yes);
}

TEST_F(ClaimsTest, NameTheirGateway) {
  EXPECT_EQ(machines::name_of(claim(1, 1s)), "gateway 5f3a9c0112d4 (pid 4711 on host7)");
}

}  // namespace
}  // namespace millrace::gateway
