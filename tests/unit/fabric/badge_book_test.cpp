#include "fabric/badge_book.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr BadgeBook::Handle badge_writer = 1;
constexpr BadgeBook::Handle bearer = 2;
constexpr BadgeBook::Handle some_writer = 3;

class BadgeBookTest : public testing::Test {
 protected:
  void show(const std::string& name = "gateway-1") {
    sut.put_on(badge_writer, bearer, {.name = name});
    sut.matched(some_writer, bearer);
  }
  BadgeBook sut;
};

TEST_F(BadgeBookTest, KnowsWhoseAWriterIs) {
  show();
  ASSERT_TRUE(sut.proof_of_writer(some_writer).badge);
  EXPECT_EQ(sut.proof_of_writer(some_writer).badge->name, "gateway-1");
  EXPECT_TRUE(sut.is_there(bearer));
  EXPECT_THAT(sut.participants(), ElementsAre(bearer));
  EXPECT_FALSE(sut.proof_of_writer(99).badge);
}

TEST_F(BadgeBookTest, KnowsAWriterThatIsThereBeforeTheBadge) {
  sut.matched(some_writer, bearer);
  EXPECT_FALSE(sut.proof_of_writer(some_writer).badge);
  sut.put_on(badge_writer, bearer, {.name = "late"});
  EXPECT_TRUE(sut.proof_of_writer(some_writer).badge);
}

TEST_F(BadgeBookTest, RemembersForAWhileWhoHasLeft) {
  show();
  sut.unmatched(some_writer);
  EXPECT_EQ(sut.take_off(badge_writer), bearer);
  EXPECT_EQ(sut.take_off(badge_writer), std::nullopt);
  EXPECT_FALSE(sut.is_there(bearer));
  EXPECT_TRUE(sut.proof_of_writer(some_writer).badge);
  for (BadgeBook::Handle i = 100; i < 100 + 2 * BadgeBook::most_departed; i += 2) {
    sut.put_on(i, i + 1, {.name = "passer-by"});
    sut.take_off(i);
  }
  EXPECT_FALSE(sut.proof_of(bearer).badge);
  for (BadgeBook::Handle i = 10'000; i < 10'000 + BadgeBook::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  show();
  EXPECT_TRUE(sut.proof_of_writer(some_writer).badge);
}

TEST_F(BadgeBookTest, ForgetsNoWriterThatAnotherReaderIsMatchedWith) {
  show();
  sut.matched(some_writer, bearer);
  sut.unmatched(some_writer);
  for (BadgeBook::Handle i = 10'000; i < 10'000 + 2 * BadgeBook::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  EXPECT_TRUE(sut.proof_of_writer(some_writer).badge);
}

TEST_F(BadgeBookTest, ForgetsNoWriterThatIsMatchedAgain) {
  show();
  sut.unmatched(some_writer);
  sut.matched(some_writer, bearer);
  for (BadgeBook::Handle i = 10'000; i < 10'000 + 2 * BadgeBook::most_departed; ++i) {
    sut.matched(i, bearer);
    sut.unmatched(i);
  }
  EXPECT_TRUE(sut.proof_of_writer(some_writer).badge);
}

TEST_F(BadgeBookTest, KnowsWhetherAGatewayOfAMachineIsThere) {
  EXPECT_FALSE(sut.has_gateway_of("press_1"));
  sut.put_on(9, 90, {.name = "gateway-9", .roles = {"gateway"}, .machines = {"press_1"}});
  EXPECT_TRUE(sut.has_gateway_of("press_1"));
  EXPECT_TRUE(sut.has_gateway_of("press_1.orders"));
  EXPECT_FALSE(sut.has_gateway_of("press_2"));
  sut.take_off(9);
  EXPECT_FALSE(sut.has_gateway_of("press_1"));
}

TEST_F(BadgeBookTest, TellsOfWhomARevocationIsNews) {
  show();
  EXPECT_THAT(sut.revoke({"somebody"}), IsEmpty());
  EXPECT_THAT(sut.revoke({"gateway-1", "somebody"}), ElementsAre(bearer));
  EXPECT_TRUE(sut.proof_of_writer(some_writer).revoked);
  EXPECT_TRUE(sut.is_revoked("gateway-1"));
  EXPECT_THAT(sut.revoke({"gateway-1"}), IsEmpty());
}

// An older list that is copied over a newer one gives nobody his certificate back.
TEST_F(BadgeBookTest, ForgetsNoRevocationAndTellsWhoIsMissingInAnOlderList) {
  show();
  EXPECT_THAT(sut.revoke({"gateway-1", "somebody"}), ElementsAre(bearer));
  EXPECT_THAT(sut.left_out_of({"gateway-1", "somebody", "else"}), IsEmpty());
  EXPECT_THAT(sut.left_out_of({"somebody"}), ElementsAre("gateway-1"));
  EXPECT_THAT(sut.revoke({"somebody"}), IsEmpty());
  EXPECT_TRUE(sut.proof_of(bearer).revoked);
}

}  // namespace
}  // namespace millrace::fabric
