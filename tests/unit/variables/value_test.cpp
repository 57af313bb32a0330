#include "cnc/variables/value.hpp"

#include <gmock/gmock.h>

#include "cnc/variables/names.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

ElementType of(Type type) {
  return {type, size_of(type)};
}

constexpr ElementType text{Type::string, 128};

std::string error_of(ElementType type, const std::string& written) {
  const auto bytes = encode_elements(type, {written});
  return bytes ? "" : bytes.error();
}

TEST(AValue, OfEveryTypeIsEncodedAndDecoded) {
  for (const auto& [type, written, element] : std::vector<std::tuple<Type, std::string, Element>>{
           {Type::boolean, "TRUE", true},
           {Type::sgn08, "-128", std::int64_t{-128}},
           {Type::uns08, "255", std::int64_t{255}},
           {Type::sgn16, "-32768", std::int64_t{-32768}},
           {Type::uns16, "65535", std::int64_t{65535}},
           {Type::sgn32, "-2147483648", std::int64_t{-2147483648}},
           {Type::uns32, "4294967295", std::int64_t{4294967295}},
           {Type::real64, "-3.5e-3", -3.5e-3}}) {
    const auto bytes = encode_elements(of(type), {written});
    ASSERT_TRUE(bytes) << bytes.error();
    EXPECT_EQ(bytes->size(), size_of(type));
    EXPECT_THAT(*decode_elements(of(type), *bytes), ElementsAre(element)) << name_of(type);
  }
}

TEST(AValue, BeyondTheRangeOfItsTypeIsRefusedWithTheRange) {
  EXPECT_THAT(error_of(of(Type::sgn08), "128"), HasSubstr("expected -128 to 127"));
  EXPECT_THAT(error_of(of(Type::uns08), "-1"), HasSubstr("expected 0 to 255"));
  EXPECT_THAT(error_of(of(Type::uns32), "4294967296"), HasSubstr("expected 0 to 4294967295"));
  EXPECT_THAT(error_of(of(Type::uns32), "99999999999999999999"), HasSubstr("is not a UNS32"));
  EXPECT_THAT(error_of(of(Type::real64), "1e999"), HasSubstr("is not a REAL64"));
  EXPECT_THAT(error_of(of(Type::real64), "nan"), HasSubstr("is not a REAL64"));
}

TEST(AValue, ThatIsNoneOfItsTypeIsRefused) {
  EXPECT_THAT(error_of(of(Type::boolean), "2"), HasSubstr("expected TRUE or FALSE"));
  EXPECT_THAT(error_of(of(Type::sgn16), "12x"), HasSubstr("is not a SGN16"));
  EXPECT_THAT(error_of(of(Type::sgn16), "1.5"), HasSubstr("is not a SGN16"));
  EXPECT_THAT(error_of(of(Type::real64), ""), HasSubstr("is not a REAL64"));
}

TEST(AText, HoldsItsBytesUpToTheFirstNul) {
  const Bytes padded{'a', 0xDF, 0, 'x'};
  EXPECT_THAT(*decode_elements(text, padded), ElementsAre(Element("a\xDF")));
  EXPECT_THAT(*encode_elements(text, {"a\xDF"}), ElementsAre('a', 0xDF, 0));
  EXPECT_THAT(*decode_elements(text, Bytes{0}), ElementsAre(Element(std::string())));
}

TEST(AText, HasRoomFor127Bytes) {
  EXPECT_TRUE(encode_elements(text, {std::string(127, 'x')}));
  EXPECT_THAT(error_of(text, std::string(128, 'x')), HasSubstr("128 bytes"));
  EXPECT_THAT(error_of({Type::string, 21}, std::string(21, 'x')), HasSubstr("holds 20"));
}

TEST(AnArray, HasOneElementBehindTheOther) {
  const auto bytes = encode_elements(of(Type::sgn16), {"1", "-2", "3"});
  EXPECT_THAT(*bytes, ElementsAre(1, 0, 0xFE, 0xFF, 3, 0));
  EXPECT_THAT(*decode_elements(of(Type::sgn16), *bytes),
              ElementsAre(std::int64_t{1}, std::int64_t{-2}, std::int64_t{3}));
  EXPECT_FALSE(decode_elements(of(Type::sgn16), Bytes{1, 2, 3}));
  EXPECT_FALSE(decode_elements(of(Type::sgn16), Bytes{}));
}

TEST(AnArray, OfTextsHasBuffersOfOneSize) {
  const ElementType buffer{Type::string, 4};
  const auto bytes = encode_elements(buffer, {"ab", "c"});
  EXPECT_THAT(*bytes, ElementsAre('a', 'b', 0, 0, 'c', 0, 0, 0));
  EXPECT_THAT(*decode_elements(buffer, *bytes), ElementsAre(Element("ab"), Element("c")));
}

TEST(AnArray, NamesTheElementThatIsWrong) {
  const auto bytes = encode_elements(of(Type::uns08), {"1", "300"});
  EXPECT_THAT(bytes.error(), HasSubstr("element 1"));
}

TEST(ADescription, GivesTheSizeOfOneElement) {
  EXPECT_EQ(*element_type({0, Type::sgn16, Access::read_write, 6, {3}, {}}), of(Type::sgn16));
  const ElementType buffer{Type::string, 21};
  EXPECT_EQ(*element_type({0, Type::string, Access::read_write, 42, {2}, {}}), buffer);
}

TEST(ADescription, ThatMakesNoSenseIsRefused) {
  EXPECT_FALSE(element_type({0, Type{77}, Access::read_write, 4, {}, {}}));
  EXPECT_FALSE(element_type({0, Type::string, Access::read_write, 5, {2}, {}}));
  EXPECT_FALSE(element_type({0, Type::string, Access::read_write, 0, {}, {}}));
  EXPECT_FALSE(element_type({0, Type::uns08, Access::read_write, 1, {0}, {}}));
  EXPECT_FALSE(element_type({0, Type::uns08, Access::read_write, 1, {0xFFFFFFFF, 0xFFFFFFFF}, {}}));
}

TEST(AType, IsKnownByTheVendorsNameInAnyCase) {
  EXPECT_EQ(parse_type("uns32"), Type::uns32);
  EXPECT_EQ(parse_type("UNS"), std::nullopt);
  EXPECT_EQ(name_of(Type{0}), "UNKNOWN");
}

}  // namespace
}  // namespace millrace::cnc::variables
