#include "cnc/simulator/type.hpp"

#include <gtest/gtest.h>

namespace millrace::cnc::simulator {
namespace {

using ads::Bytes;

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
