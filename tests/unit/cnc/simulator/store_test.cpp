#include "cnc/simulator/store.hpp"

#include <gtest/gtest.h>

#include "cnc/simulator/type.hpp"
#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator {
namespace {

using ads::Bytes;

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

struct NumberCase {
  Type type;
  double value;
  Bytes bytes;
};

class Number : public testing::TestWithParam<NumberCase> {};

TEST_P(Number, IsBinaryAndLittleEndianBothWays) {
  const auto& [type, value, bytes] = GetParam();
  const ElementType element = ElementType::number(type);
  EXPECT_EQ(encode(element, value), bytes);
  EXPECT_EQ(decode(element, bytes), nc::Value{value});
  EXPECT_EQ(accept(element, bytes), bytes);
}

INSTANTIATE_TEST_SUITE_P(
    OfType, Number,
    testing::Values(NumberCase{Type::boolean, 1, {1}}, NumberCase{Type::sgn08, -128, {0x80}},
                    NumberCase{Type::uns08, 255, {0xFF}}, NumberCase{Type::sgn16, -2, {0xFE, 0xFF}},
                    NumberCase{Type::uns16, 0x1234, {0x34, 0x12}},
                    NumberCase{Type::sgn32, -2147483648.0, {0, 0, 0, 0x80}},
                    NumberCase{Type::uns32, 4294967295.0, {0xFF, 0xFF, 0xFF, 0xFF}},
                    NumberCase{Type::real64, 1.5, {0, 0, 0, 0, 0, 0, 0xF8, 0x3F}}));

TEST(Encode, RoundsToTheNearestInteger) {
  EXPECT_EQ(encode(ElementType::number(Type::sgn08), -1.6), (Bytes{0xFE}));
}

TEST(Encode, RefusesANumberThatDoesNotFitItsType) {
  for (const double value : {-1.0, 4294967296.0, std::numeric_limits<double>::infinity(),
                             std::numeric_limits<double>::quiet_NaN()}) {
    const auto sut = encode(ElementType::number(Type::uns32), value);
    ASSERT_FALSE(sut) << value;
    EXPECT_EQ(sut.error().id, 21883);
  }
}

TEST(Encode, RefusesAStringForANumber) {
  EXPECT_EQ(encode(ElementType::number(Type::uns32), "7").error().id, 21461);
}

TEST(Encode, RefusesANumberForAString) {
  EXPECT_EQ(encode(ElementType::text(3), 7.0).error().id, 21460);
}

TEST(Encode, FillsAStringUpToItsSize) {
  EXPECT_EQ(encode(ElementType::text(3), "ab"), (Bytes{'a', 'b', 0, 0}));
  EXPECT_EQ(encode(ElementType::text(3), "abc"), (Bytes{'a', 'b', 'c', 0}));
}

TEST(Encode, RefusesAStringThatIsTooLong) {
  const auto sut = encode(ElementType::text(3), "abcd");
  ASSERT_FALSE(sut);
  EXPECT_EQ(sut.error().id, 21462);
}

TEST(Type, IsTheSameInPrograms) {
  EXPECT_EQ(shape_of(ElementType::text(20)), (nc::VariableShape{nc::VariableType::string, 20, {}}));
  EXPECT_EQ(element_of({nc::VariableType::string, 20, {}}).size, 21);
  for (std::uint32_t number = 1; number <= 8; ++number) {
    const Type type{number};
    EXPECT_EQ(element_of(shape_of(ElementType::number(type))).type, type) << name_of(type);
  }
}

TEST(Decode, TreatsAnyByteButZeroAsTrue) {
  const Bytes bytes{2};
  EXPECT_EQ(decode(ElementType::number(Type::boolean), bytes), nc::Value{1.0});
}

TEST(Decode, EndsAStringAtItsNul) {
  const Bytes bytes{'a', 0, 'b', 0};
  EXPECT_EQ(decode(ElementType::text(3), bytes), nc::Value{"a"});
}

}  // namespace
}  // namespace millrace::cnc::simulator
