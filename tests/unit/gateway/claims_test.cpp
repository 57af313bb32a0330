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
  return fabric::Time(time);
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

TEST_F(ClaimsTest, LetTheEarlierOneServe) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(11s)), NotNull());
}

TEST_F(ClaimsTest, DecideBetweenTwoOfOneMomentByTheirIds) {
  sut.set(claim(1, 10s));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(10s)), NotNull());
  sut.remove("cnc", gateway(1));
  sut.set(claim(9, 10s));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(10s)), IsNull());
}

TEST_F(ClaimsTest, ConcernTheChannelsTheyNameOrAll) {
  sut.set(claim(1, 1s, {2}));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(9s)), IsNull());
  EXPECT_THAT(sut.ahead({"cnc", 2}, at(9s)), NotNull());
  EXPECT_THAT(sut.ahead({"press", 2}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(9s)), NotNull());
}

TEST_F(ClaimsTest, TakeAMachineWholeOnlyIfTheyCoverAllThatIsWanted) {
  sut.set(claim(1, 1s, {1, 2}));
  EXPECT_THAT(sut.ahead_of_all("cnc", {2}, at(9s)), NotNull());
  EXPECT_THAT(sut.ahead_of_all("cnc", {2, 3}, at(9s)), IsNull());
  EXPECT_THAT(sut.ahead_of_all("cnc", {}, at(9s)), IsNull());
  sut.set(claim(1, 1s));
  EXPECT_THAT(sut.ahead_of_all("cnc", {}, at(9s)), NotNull());
  EXPECT_THAT(sut.ahead_of_all("cnc", {}, at(0s)), IsNull());
}

TEST_F(ClaimsTest, AreVoidOnceTheirGatewayIsGone) {
  sut.set(claim(1, 1s));
  EXPECT_TRUE(sut.contested("cnc"));
  sut.remove("cnc", gateway(1));
  EXPECT_THAT(sut.ahead({"cnc", 1}, at(9s)), IsNull());
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, OfOurOwnAreNotListenedTo) {
  sut.set(claim(5, 1s));
  EXPECT_FALSE(sut.contested("cnc"));
}

TEST_F(ClaimsTest, ComeAfterThoseThatServeWhateverTheClocksSay) {
  sut.set(claim(1, 60s));
  EXPECT_EQ(sut.behind_those_that_serve("cnc", at(5s)), at(5s));
  auto serving = claim(2, 50s);
  serving.connected = true;
  sut.set(serving);
  EXPECT_EQ(sut.behind_those_that_serve("cnc", at(5s)), at(50s) + 1ns);
  EXPECT_EQ(sut.behind_those_that_serve("cnc", at(55s)), at(55s));
}

TEST_F(ClaimsTest, NameTheirGateway) {
  EXPECT_EQ(machines::name_of(claim(1, 1s)), "gateway 5f3a9c0112d4 (pid 4711 on host7)");
}

}  // namespace
}  // namespace millrace::gateway
