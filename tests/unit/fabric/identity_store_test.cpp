#include "fabric/identity_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr IdentityStore::Handle identity_writer = 1;
constexpr IdentityStore::Handle bearer = 2;
constexpr IdentityStore::Handle some_writer = 3;

class IdentityStoreTest : public testing::Test {
 protected:
  void show(const std::string& name = "gateway-1") {
    sut.add(identity_writer, bearer, {.name = name});
    sut.matched(some_writer, bearer);
  }
  IdentityStore sut;
};

TEST_F(IdentityStoreTest, HasTheIdentityOfAWriter) {
  show();
  ASSERT_TRUE(sut.status_of_writer(some_writer).identity);
  EXPECT_EQ(sut.status_of_writer(some_writer).identity->name, "gateway-1");
  EXPECT_TRUE(sut.is_there(bearer));
  EXPECT_THAT(sut.participants(), ElementsAre(bearer));
  EXPECT_FALSE(sut.status_of_writer(99).identity);
}

TEST_F(IdentityStoreTest, HasTheIdentityOfAWriterThatMatchedBefore) {
  sut.matched(some_writer, bearer);
  EXPECT_FALSE(sut.status_of_writer(some_writer).identity);
  sut.add(identity_writer, bearer, {.name = "late"});
  EXPECT_TRUE(sut.status_of_writer(some_writer).identity);
}

TEST_F(IdentityStoreTest, RemembersAWriterThatHasLeftForAWhile) {
  show();
  sut.unmatched(some_writer);
  EXPECT_EQ(sut.remove(identity_writer), bearer);
  EXPECT_EQ(sut.remove(identity_writer), std::nullopt);
  EXPECT_FALSE(sut.is_there(bearer));
  EXPECT_TRUE(sut.status_of_writer(some_writer).identity);
  for (IdentityStore::Handle i = 100; i < 100 + 2 * IdentityStore::most_departed; i += 2) {
    sut.add(i, i + 1, {.name = "passer-by"});
    sut.remove(i);
  }
  EXPECT_FALSE(sut.status_of(bearer).identity);
  for (IdentityStore::Handle i = 10'000; i < 10'000 + IdentityStore::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  show();
  EXPECT_TRUE(sut.status_of_writer(some_writer).identity);
}

TEST_F(IdentityStoreTest, ForgetsNoWriterThatAnotherReaderIsMatchedWith) {
  show();
  sut.matched(some_writer, bearer);
  sut.unmatched(some_writer);
  for (IdentityStore::Handle i = 10'000; i < 10'000 + 2 * IdentityStore::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  EXPECT_TRUE(sut.status_of_writer(some_writer).identity);
}

TEST_F(IdentityStoreTest, ForgetsNoWriterThatIsMatchedAgain) {
  show();
  sut.unmatched(some_writer);
  sut.matched(some_writer, bearer);
  for (IdentityStore::Handle i = 10'000; i < 10'000 + 2 * IdentityStore::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  EXPECT_TRUE(sut.status_of_writer(some_writer).identity);
}

TEST_F(IdentityStoreTest, KnowsWhetherAMachineHasAGateway) {
  EXPECT_FALSE(sut.has_gateway_of("press_1"));
  sut.add(9, 90, {.name = "gateway-9", .roles = {"gateway"}, .machines = {"press_1"}});
  EXPECT_TRUE(sut.has_gateway_of("press_1"));
  EXPECT_TRUE(sut.has_gateway_of("press_1.orders"));
  EXPECT_FALSE(sut.has_gateway_of("press_2"));
  sut.remove(9);
  EXPECT_FALSE(sut.has_gateway_of("press_1"));
}

TEST_F(IdentityStoreTest, ReturnsTheNewlyRevokedParticipants) {
  show();
  EXPECT_THAT(sut.revoke({"service-1"}), IsEmpty());
  EXPECT_THAT(sut.revoke({"gateway-1", "service-1"}), ElementsAre(bearer));
  EXPECT_TRUE(sut.status_of_writer(some_writer).revoked);
  EXPECT_TRUE(sut.is_revoked("gateway-1"));
  EXPECT_THAT(sut.revoke({"gateway-1"}), IsEmpty());
}

// An older list that is copied over a newer one makes no revoked certificate valid again.
TEST_F(IdentityStoreTest, ForgetsNoRevocationAndNamesThoseMissingInAnOlderList) {
  show();
  EXPECT_THAT(sut.revoke({"gateway-1", "service-1"}), ElementsAre(bearer));
  EXPECT_THAT(sut.left_out_of({"gateway-1", "service-1", "else"}), IsEmpty());
  EXPECT_THAT(sut.left_out_of({"service-1"}), ElementsAre("gateway-1"));
  EXPECT_THAT(sut.revoke({"service-1"}), IsEmpty());
  EXPECT_TRUE(sut.status_of(bearer).revoked);
}

}  // namespace
}  // namespace millrace::fabric
