#include "cnc/ads/sum_codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/sum_commands.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/unit/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;
using testing::SizeIs;

const std::vector<SumItem> two_items{{{1, 1}, 8, {1, 2, 3}}, {{9, 9}, 4, {}}};

Bytes answer() {
  auto payload = tests::hex_vector("ads/sums.hex", "read_write_answer");
  payload.erase(payload.begin(), payload.begin() + 8);
  return payload;
}

TEST(SumOfReadWrites, HasAllItemsBeforeAllData) {
  auto expected = tests::hex_vector("ads/sums.hex", "read_write");
  expected.erase(expected.begin(), expected.begin() + 16);
  expected[8] = 8;  // the vector requests 0xFFFFFFFF bytes
  expected[9] = expected[10] = expected[11] = 0;
  EXPECT_EQ(encode_sum(two_items), expected);
  EXPECT_EQ(sum_length(two_items), 28U);
}

TEST(SumOfReadWrites, GivesEachItemItsOwnResult) {
  const auto sut = decode_sum(answer(), two_items);
  ASSERT_TRUE(sut);
  ASSERT_THAT(*sut, SizeIs(2));
  EXPECT_THAT(*(*sut)[0], ElementsAre(0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88));
  EXPECT_EQ((*sut)[1].error(), ErrorCode::invalid_group);
}

TEST(SumOfReadWrites, BreaksTheProtocolWithLengthsThatDoNotFit) {
  auto cut = answer();
  cut.pop_back();
  EXPECT_EQ(decode_sum(cut, two_items).error(), ErrorCode::protocol_error);
  auto too_long = answer();
  too_long[4] = 9;
  too_long.push_back(0);
  EXPECT_EQ(decode_sum(too_long, two_items).error(), ErrorCode::protocol_error);
  EXPECT_EQ(decode_sum({}, two_items).error(), ErrorCode::protocol_error);
}

TEST(SumOfReadWrites, IsUnderstoodByADevice) {
  MemoryDevice memory;
  memory.values[{1, 1}] = {0xAA};
  SumCommands device(memory);
  const auto bytes =
      device.read_write(552, {sum::read_write, 2}, sum_length(two_items), encode_sum(two_items));
  const auto sut = decode_sum(*bytes, two_items);
  EXPECT_THAT(*sut->at(0), ElementsAre(0xAA));
  EXPECT_THAT(memory.values[(Index{1, 1})], ElementsAre(1, 2, 3));
}

}  // namespace
}  // namespace millrace::cnc::ads
