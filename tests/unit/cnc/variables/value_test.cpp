#include "cnc/variables/value.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/variables/layout.hpp"
#include "cnc/variables/names.hpp"
#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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

TEST(AType, HasTheVendorsName) {
  EXPECT_EQ(name_of(Type::uns32), "UNS32");
  EXPECT_EQ(name_of(Type{0}), "UNKNOWN");
}

TEST(CncText, EndsAtTheFirstNulOrWithItsBytes) {
  EXPECT_EQ(decode_text(ads::Bytes{'o', 'k', 0}), "ok");
  EXPECT_EQ(decode_text(ads::Bytes{'o', 'k', 0, 0, 'x', 0}), "ok");
  EXPECT_EQ(decode_text(ads::Bytes{'o', 'k'}), "ok");
  EXPECT_EQ(decode_text({}), "");
}

TEST(CncText, IsSentWithItsNul) {
  EXPECT_EQ(*encode_text("ok"), (ads::Bytes{'o', 'k', 0}));
}

TEST(CncText, Of127BytesFits) {
  EXPECT_EQ(encode_text(std::string(127, 'x'))->size(), 128U);
}

TEST(CncText, Of128BytesIsRefusedAndNotCut) {
  const auto sut = encode_text(std::string(128, 'x'));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr("has 128 bytes, a CNC string holds 127"));
}

TEST(CncText, WithANulIsRefused) {
  const auto sut = encode_text(std::string("a\0b", 3));
  ASSERT_FALSE(sut);
  EXPECT_THAT(sut.error(), HasSubstr("NUL at byte 1"));
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

Bytes vector(const std::string& name) {
  return tests::hex_vector("variables/streams.hex", name);
}

TEST(VariableStreams, NameAndValueAreSeparatedByOneNul) {
  const auto stream = vector("write_by_name");
  const auto sut = decode_name(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "V.G.SERVICE.REQUEST_STATE");
  EXPECT_THAT(sut->value, ElementsAre(0, 0, 0, 0));
  EXPECT_EQ(encode_name(sut->name, sut->value), stream);
}

TEST(VariableStreams, AReadByNameHasNoValue) {
  const auto stream = vector("read_by_name");
  const auto sut = decode_name(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "V.G.SERVICE.UUID");
  EXPECT_THAT(sut->value, IsEmpty());
}

TEST(VariableStreams, ANameWithoutNulEndsWithItsStream) {
  const auto stream = vector("name_without_nul");
  const auto sut = decode_name(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->name, "V.G.SERVICE.UUID");
}

TEST(VariableStreams, ANameIsNeitherEmptyNorLongerThanDocumented) {
  EXPECT_FALSE(decode_name({}));
  EXPECT_FALSE(decode_name(Bytes{0, 'x'}));
  EXPECT_TRUE(decode_name(encode_name(std::string(255, 'N'))));
  EXPECT_FALSE(decode_name(encode_name(std::string(256, 'N'))));
}

TEST(VariableStreams, AScalarIsReadByItsHandleAlone) {
  const auto stream = vector("read_by_handle");
  const auto sut = decode_handle_stream(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->element, (ElementOf{0x0102001B, {}}));
  EXPECT_THAT(sut->value, IsEmpty());
  EXPECT_EQ(encode(sut->element), stream);
}

TEST(VariableStreams, AnArrayElementIsWrittenByHandleIndicesAndValue) {
  const auto stream = vector("write_element_by_handle");
  const auto sut = decode_handle_stream(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->element, (ElementOf{0x20012341, {4, 2}}));
  EXPECT_THAT(sut->value, ElementsAre(7));
  EXPECT_EQ(encode(sut->element, sut->value), stream);
}

TEST(VariableStreams, ACountOfIndicesIsNotTrusted) {
  EXPECT_FALSE(decode_handle_stream(vector("handle_with_too_many_indices")));
}

TEST(VariableStreams, DescribesAScalarWithoutItsName) {
  const auto stream = vector("description_of_scalar");
  const auto sut = decode_description(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(*sut, (Description{0x0102001B, Type::string, Access::read_write, 128, {}, ""}));
  EXPECT_EQ(encode(*sut, NameInDescription::no), stream);
}

TEST(VariableStreams, DescribesAnArrayWithItsName) {
  const auto stream = vector("description_of_array");
  const auto sut = decode_description(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(*sut, (Description{0x20012341, Type::real64, Access::read_only, 8, {3, 10}, "V.E.A"}));
  EXPECT_EQ(encode(*sut, NameInDescription::yes), stream);
}

TEST(VariableStreams, ADescriptionCutShortIsNone) {
  EXPECT_FALSE(decode_description(vector("description_cut_short")));
}

TEST(VariableStreams, AnIndexCountsAmongTheVariablesOfAKind) {
  const auto stream = vector("index_of_kind");
  const auto sut = decode_index_stream(stream);
  ASSERT_TRUE(sut);
  EXPECT_EQ(sut->index, 2U);
  EXPECT_EQ(sut->kind, "V.E");
  EXPECT_EQ(encode(*sut), stream);
}

}  // namespace
}  // namespace millrace::cnc::variables
