#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"

namespace millrace::base::messages {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(AMessage, IsASentenceOfTheCatalogueWithItsArguments) {
  const Message sut = instances_busy(3);
  EXPECT_EQ(sut.code, "instances_busy");
  EXPECT_THAT(sut.arguments, ElementsAre("3"));
  EXPECT_EQ(sut.text, "all 3 instances are busy");
  EXPECT_TRUE(instances_busy.is(sut));
  EXPECT_FALSE(only_instance_busy.is(sut));
}

TEST(AMessage, HasSentencesInItsPlaces) {
  const Message sut = declined("sq1", no_room(2));
  EXPECT_EQ(sut.text, "sq1 declines it: it runs at most 2 calls at once");
  ASSERT_THAT(sut.arguments, SizeIs(2));
  EXPECT_EQ(sut.arguments[0], Message("sq1"));
  EXPECT_EQ(sut.arguments[1], no_room(2));
}

TEST(AMessage, IsNotTheSameAsItsText) {
  const Message sut = only_instance_busy();
  EXPECT_EQ(sut, "the only instance is busy");
  EXPECT_NE(sut, Message("the only instance is busy"));
  EXPECT_NE(instances_busy(3), instances_busy(4));
}

// A sample of another process may lack what its code promises.
TEST(AMessage, WithoutItsArgumentsIsNotTheSentence) {
  Message sut = answered_by("ann@hmi");
  sut.arguments.clear();
  EXPECT_FALSE(answered_by.is(sut));
}

TEST(AMessage, TravelsAsPartsEachFollowedByItsArguments) {
  const Message sut = declined("sq1", no_room(2));
  EXPECT_THAT(parts_of(sut),
              ElementsAre(MessagePart{"declined", 2, sut.text}, MessagePart{"", 0, "sq1"},
                          MessagePart{"no_room", 1, "it runs at most 2 calls at once"},
                          MessagePart{"", 0, "2"}));
  EXPECT_EQ(message_of(parts_of(sut)), sut);
  EXPECT_THAT(parts_of({}), IsEmpty());
  EXPECT_EQ(message_of({}), Message());
}

TEST(AMessage, OfForeignPartsHasTheArgumentsThatAreThere) {
  const Message sut = message_of({{"declined", 2, "text"}, {"", 0, "sq1"}});
  EXPECT_EQ(sut.text, "text");
  EXPECT_THAT(sut.arguments, ElementsAre("sq1"));
  EXPECT_THAT(message_of({{"a", 0, "text"}, {"", 0, "more"}}).arguments, IsEmpty());
}

TEST(AMessage, OfForeignPartsIsNeitherDeepNorWideWithoutEnd) {
  const Message deep = message_of(std::vector<MessagePart>(1000, {"deep", 1, "text"}));
  int depth = 0;
  for (const Message* each = &deep; !each->arguments.empty(); each = &each->arguments.front()) {
    ++depth;
  }
  EXPECT_EQ(depth, 4);
  std::vector<MessagePart> wide(256, {"", 0, "text"});
  wide.front().arguments = 255;
  EXPECT_THAT(message_of(wide).arguments, SizeIs(8));
}

TEST(TheCatalogue, HasEachCodeOnceAndNoneThatIsTooLongToTravel) {
  std::set<std::string_view> codes;
  for (const CatalogueRow& row : catalogue) {
    EXPECT_TRUE(codes.insert(row.code).second) << row.code;
    EXPECT_LE(row.code.size(), 63U) << row.code;
    EXPECT_EQ(row.code.find_first_not_of("abcdefghijklmnopqrstuvwxyz_"), std::string_view::npos)
        << row.code;
  }
}

}  // namespace
}  // namespace millrace::base::messages
