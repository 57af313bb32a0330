#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/variables/value.hpp"

namespace millrace::cnc::variables {
namespace {

using testing::HasSubstr;

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

}  // namespace
}  // namespace millrace::cnc::variables
