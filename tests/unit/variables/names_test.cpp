#include "cnc/variables/names.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::variables {
namespace {

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
