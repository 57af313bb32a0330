#include "cnc/variables/layout.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/hex_vectors.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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
