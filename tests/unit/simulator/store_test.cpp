#include "cnc/simulator/store.hpp"

#include <gtest/gtest.h>

#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator {
namespace {

TEST(VariableName, SplitsOffTheIndices) {
  const auto sut = VariableName::parse("V.E.TABLE[2][7]");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->base, "V.E.TABLE");
  EXPECT_EQ(sut->indices, (std::vector<std::uint32_t>{2, 7}));
}

TEST(VariableName, KeepsTheMemberBehindTheIndices) {
  const auto sut = VariableName::parse("V.G.NP[5].V.X_ACHSE");
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->base, "V.G.NP.V.X_ACHSE");
  EXPECT_EQ(sut->indices, std::vector<std::uint32_t>{5});
  EXPECT_EQ(sut->behind, std::string_view(".V.X_ACHSE").size());
}

TEST(VariableName, RefusesWhatIsNoName) {
  for (const char* text : {"", "[1]", "A[", "A[]", "A[x]", "A[-1]", "A[1", "A[1]B", "A[1]]",
                           "A[4294967296]", "A]1[", "A[1].", "A[1].B[2]", "A[1].B]"}) {
    EXPECT_FALSE(VariableName::parse(text)) << text;
  }
}

class StoreWithArray : public testing::Test {
 protected:
  StoreWithArray() {
    table_ = std::make_shared<Variable>(
        Declaration{"V.E.TABLE", ElementType::number(Type::uns16), Access::read_write, {2, 3}});
    sut_.family(Kind::external).add(table_);
  }

  std::shared_ptr<Variable> table_;
  Store sut_;
};

TEST_F(StoreWithArray, CountsElementsRowByRow) {
  EXPECT_EQ(sut_.find("V.E.TABLE[1][2]")->element, 5);
  EXPECT_EQ(sut_.find("V.E.TABLE[0][0]")->element, 0);
}

TEST_F(StoreWithArray, TreatsAMissingIndexAsTheWholeArray) {
  EXPECT_EQ(sut_.find("V.E.TABLE")->element, std::nullopt);
}

TEST_F(StoreWithArray, FindsNothingBeyondTheArray) {
  EXPECT_FALSE(sut_.find("V.E.TABLE[2][0]"));
  EXPECT_FALSE(sut_.find("V.E.TABLE[0][3]"));
  EXPECT_FALSE(sut_.find("V.E.TABLE[0]"));
  EXPECT_FALSE(sut_.find("V.E.TABLE[0][0][0]"));
}

TEST_F(StoreWithArray, FindsTheSameByHandle) {
  const auto handle = sut_.handle("V.E.TABLE");
  ASSERT_TRUE(handle);
  const std::vector<std::uint32_t> indices{1, 2};
  EXPECT_EQ(sut_.find(*handle, indices)->element, 5);
  EXPECT_EQ(sut_.find(*handle, {})->element, std::nullopt);
  EXPECT_FALSE(sut_.handle("V.E.TABLE[0][0]"));
}

TEST_F(StoreWithArray, WritesAWholeArrayOrNothing) {
  const ads::Bytes all{1, 0, 2, 0, 3, 0, 4, 0, 5, 0, 6, 0};
  ASSERT_TRUE(sut_.find("V.E.TABLE")->write(all));
  EXPECT_EQ(table_->value(5), nc::Value{6.0});
  EXPECT_EQ(sut_.find("V.E.TABLE")->write(ads::Bytes{1, 0}).error(), ads::ErrorCode::invalid_size);
  EXPECT_EQ(sut_.find("V.E.TABLE")->read(), all);
}

TEST(Variable, ThatIsComputedCannotBeWritten) {
  Variable sut({"V.G.BLOCK_NR", ElementType::number(Type::sgn32), Access::read_only, {}},
               [](std::uint32_t) { return nc::Value{10.0}; });
  EXPECT_EQ(sut.bytes(Variable::scalar), (ads::Bytes{10, 0, 0, 0}));
  EXPECT_EQ(sut.write(Variable::scalar, ads::Bytes{1, 0, 0, 0}).error(),
            ads::ErrorCode::access_denied_index);
  EXPECT_FALSE(sut.assign(Variable::scalar, 1.0));
}

TEST(Variable, OfAnArrayOfStringsKeepsEachString) {
  Variable sut({"V.E.NAMES", ElementType::text(3), Access::read_write, {2}});
  EXPECT_TRUE(sut.write_all(ads::Bytes{'a', 0, 'x', 'x', 'b', 'c', 'd', 0}));
  EXPECT_EQ(sut.value(0), nc::Value{"a"});
  EXPECT_EQ(sut.value(1), nc::Value{"bcd"});
  EXPECT_EQ(sut.write_all(ads::Bytes(8, 'x')).error(), ads::ErrorCode::invalid_size);
}

}  // namespace
}  // namespace millrace::cnc::simulator
