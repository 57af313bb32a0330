#include "cnc/variables/listing.hpp"

#include <gmock/gmock.h>

#include "tests/unit/variables/controller_fixture.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::ElementsAre;
using testing::Field;

class ListingTest : public ControllerFixture {
 protected:
  ListingTest() { cnc.values = {{"V.G.A", {1, 2, 3, 4}}, {"V.G.B", {5, 6, 7, 8}}}; }
  void SetUp() override {
    start();
    sut.emplace(*client, 1);
  }
  std::optional<Channel> sut;
};

TEST_F(ListingTest, NamesEveryVariableOfAFamily) {
  EXPECT_THAT(*wait_for(list(*sut, "V.G")),
              ElementsAre(Field(&Description::name, "V.G.A"), Field(&Description::name, "V.G.B")));
}

TEST_F(ListingTest, ReturnsTheControllersError) {
  cnc.failure = ads::ErrorCode::invalid_offset;
  EXPECT_EQ(wait_for(list(*sut, "V.G")).error(), ads::ErrorCode::invalid_offset);
  EXPECT_EQ(wait_for(list(*sut, "P")).error(), ads::ErrorCode::service_not_supported);
}

TEST_F(ListingTest, FindsAVariableAndItsElementsByName) {
  EXPECT_EQ(wait_for(find(*sut, "V.G.B"))->size, 4U);
  EXPECT_EQ(wait_for(find(*sut, "V.G.B[2]"))->size, 4U);
  EXPECT_EQ(wait_for(find(*sut, "V.G.NONE")).error(), ads::ErrorCode::symbol_not_found);
}

TEST_F(ListingTest, FindsAVariableOfAnOlderControllerInItsFamily) {
  cnc.describes_by_name = false;
  EXPECT_EQ(wait_for(find(*sut, "V.G.B[2]"))->name, "V.G.B");
  EXPECT_EQ(wait_for(find(*sut, "V.G.NONE")).error(), ads::ErrorCode::symbol_not_found);
  EXPECT_EQ(wait_for(find(*sut, "V.CYC.X")).error(), ads::ErrorCode::invalid_offset);
}

TEST(AName, LosesItsIndicesAtTheEndOnly) {
  EXPECT_EQ(without_indices("V.E.TABLE[1][2]"), "V.E.TABLE");
  EXPECT_EQ(without_indices("V.G.NP[5].V.X"), "V.G.NP[5].V.X");
  EXPECT_EQ(without_indices("]"), "]");
}

TEST(AName, IsTheSameWithOtherIndices) {
  EXPECT_TRUE(same_but_for_indices("V.G.NP[5].V.X", "V.G.NP[98].V.X"));
  EXPECT_TRUE(same_but_for_indices("V.E.TABLE", "V.E.TABLE[1][2]"));
  EXPECT_FALSE(same_but_for_indices("V.G.NP[5].V.X", "V.G.NP[5].V.Y"));
  EXPECT_FALSE(same_but_for_indices("V.G.NP[5].V", "V.G.NP[5].V.Y"));
  EXPECT_FALSE(same_but_for_indices("V.G.A[", "V.G.B"));
}

TEST(AFamily, IsTheBeginningOfAName) {
  EXPECT_EQ(family_of("V.G.SERVICE.UUID"), "V.G");
  EXPECT_EQ(family_of("V.E.TABLE[1]"), "V.E");
  EXPECT_EQ(family_of("P17"), "P");
  EXPECT_EQ(family_of("PRESS"), "");
  EXPECT_EQ(family_of("V.GX"), "");
  EXPECT_EQ(family_of("V.CYC.X"), "");
  EXPECT_EQ(family_of(""), "");
}

}  // namespace
}  // namespace millrace::cnc::variables
