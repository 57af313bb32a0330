#include "fabric/badge_book.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr BadgeBook::Handle badge = 1;
constexpr BadgeBook::Handle participant = 2;
constexpr BadgeBook::Handle writer = 3;

class BadgeBookTest : public testing::Test {
 protected:
  void show(const std::string& name = "gateway-1") {
    sut.put_on(badge, participant, {.name = name});
    sut.matched(writer, participant);
  }
  BadgeBook sut;
};

TEST_F(BadgeBookTest, KnowsWhoseAWriterIs) {
  show();
  ASSERT_TRUE(sut.proof_of_writer(writer).badge);
  EXPECT_EQ(sut.proof_of_writer(writer).badge->name, "gateway-1");
  EXPECT_TRUE(sut.is_there(participant));
  EXPECT_THAT(sut.participants(), ElementsAre(participant));
  EXPECT_FALSE(sut.proof_of_writer(99).badge);
}

TEST_F(BadgeBookTest, KnowsAWriterThatIsThereBeforeTheBadge) {
  sut.matched(writer, participant);
  EXPECT_FALSE(sut.proof_of_writer(writer).badge);
  sut.put_on(badge, participant, {.name = "late"});
  EXPECT_TRUE(sut.proof_of_writer(writer).badge);
}

TEST_F(BadgeBookTest, RemembersForAWhileWhoHasLeft) {
  show();
  sut.unmatched(writer);
  EXPECT_EQ(sut.take_off(badge), participant);
  EXPECT_EQ(sut.take_off(badge), std::nullopt);
  EXPECT_FALSE(sut.is_there(participant));
  EXPECT_TRUE(sut.proof_of_writer(writer).badge);
  for (BadgeBook::Handle i = 100; i < 100 + 2 * BadgeBook::most_departed; i += 2) {
    sut.put_on(i, i + 1, {.name = "passer-by"});
    sut.take_off(i);
  }
  EXPECT_FALSE(sut.proof_of(participant).badge);
  for (BadgeBook::Handle i = 10'000; i < 10'000 + BadgeBook::most_departed; ++i) {
    sut.matched(i, participant);
    sut.unmatched(i);
  }
  show();
  EXPECT_TRUE(sut.proof_of_writer(writer).badge);
}

TEST_F(BadgeBookTest, ForgetsNoWriterThatAnotherReaderIsMatchedWith) {
  show();
  sut.matched(writer, participant);
  sut.unmatched(writer);
  for (BadgeBook::Handle i = 10'000; i < 10'000 + 2 * BadgeBook::most_departed; ++i) {
    sut.matched(i, participant);
    sut.unmatched(i);
  }
  EXPECT_TRUE(sut.proof_of_writer(writer).badge);
}

TEST_F(BadgeBookTest, TellsOfWhomARevocationIsNewsAndTakesItBack) {
  show();
  EXPECT_THAT(sut.revoke({"somebody"}), IsEmpty());
  EXPECT_THAT(sut.revoke({"gateway-1", "somebody"}), ElementsAre(participant));
  EXPECT_TRUE(sut.proof_of_writer(writer).revoked);
  EXPECT_TRUE(sut.is_revoked("gateway-1"));
  EXPECT_THAT(sut.revoke({"gateway-1"}), IsEmpty());
  EXPECT_THAT(sut.revoke({}), ElementsAre(participant));
  EXPECT_FALSE(sut.proof_of(participant).revoked);
}

}  // namespace
}  // namespace millrace::fabric
