#include "fabric/key_owners.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

using Sut = KeyOwners<int, int>;
constexpr auto first_come = [](int, const Sut::Sample&) { return 0; };
/// The value itself is the rank.
constexpr auto lowest = [](int, const Sut::Sample& sample) { return sample.value; };

TEST(KeyOwners, AreTheFirstWriters) {
  Sut sut;
  EXPECT_TRUE(sut.update(1, 10, 5, first_come));
  EXPECT_FALSE(sut.update(1, 11, 6, first_come));
  EXPECT_TRUE(sut.update(1, 10, 7, first_come));
  EXPECT_TRUE(sut.update(2, 11, 8, first_come));
  EXPECT_EQ(sut.find(1)->value, 7);
  EXPECT_EQ(sut.find(3), nullptr);
}

TEST(KeyOwners, AreThoseThatRankFirst) {
  Sut sut;
  EXPECT_TRUE(sut.update(1, 10, 5, lowest));
  EXPECT_FALSE(sut.update(1, 11, 5, lowest));
  EXPECT_TRUE(sut.update(1, 11, 4, lowest));
  EXPECT_EQ(sut.find(1)->writer, 11U);
}

TEST(KeyOwners, AreOthersOnceTheRanksHaveChanged) {
  Sut sut;
  sut.update(1, 10, 5, lowest);
  sut.update(1, 11, 6, lowest);
  sut.update(2, 10, 5, lowest);
  EXPECT_THAT(sut.rank_again(lowest), IsEmpty());
  EXPECT_THAT(sut.rank_again([](int, const Sut::Sample& sample) { return -sample.value; }),
              ElementsAre(1));
  EXPECT_EQ(sut.find(1)->writer, 11U);
}

TEST(KeyOwners, AreForgottenWhenTheyAreGone) {
  Sut sut;
  sut.update(1, 10, 5, first_come);
  sut.update(1, 11, 6, first_come);
  sut.update(2, 11, 7, first_come);
  sut.update(2, 10, 8, first_come);
  sut.update(3, 10, 9, first_come);
  EXPECT_THAT(sut.forget([](auto writer) { return writer == 10; }), ElementsAre(1, 3));
  EXPECT_EQ(sut.find(1)->value, 6);
  EXPECT_EQ(sut.find(2)->value, 7);
  EXPECT_EQ(sut.find(3), nullptr);
}

TEST(KeyOwners, AreNotKeptOutByManyOthers) {
  Sut sut;
  for (Sut::Handle writer = 1; writer <= 2 * Sut::most_writers; ++writer) {
    sut.update(1, writer, 9, lowest);
  }
  EXPECT_TRUE(sut.update(1, 99, 1, lowest));
}

}  // namespace
}  // namespace millrace::fabric
