#include "cnc/ads/sum_commands.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/ads/frame.hpp"
#include "cnc/ads/response.hpp"
#include "cnc/ads/session.hpp"
#include "tests/support/hex_vectors.hpp"
#include "tests/unit/cnc/ads/memory_device.hpp"

namespace millrace::cnc::ads {
namespace {

using testing::ElementsAre;

class SumCommandsTest : public testing::Test {
 protected:
  SumCommandsTest() {
    memory.values[{1, 1}] = {0x11, 0x22, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88};
    memory.values[{1, 2}] = {0xAA};
  }

  static Bytes vector(const std::string& name) { return tests::hex_vector("ads/sums.hex", name); }
  Bytes answer_to(const std::string& name) {
    return answer(sut, 552, Command::read_write, vector(name));
  }

  MemoryDevice memory;
  SumCommands sut{memory};
};

TEST_F(SumCommandsTest, ReadsIntoFixedSlotsEvenForFailedItems) {
  EXPECT_EQ(answer_to("read"), vector("read_answer"));
}

TEST_F(SumCommandsTest, ReadsWithoutResultsWhenNotCounted) {
  EXPECT_EQ(answer_to("read_uncounted"), vector("read_uncounted_answer"));
}

TEST_F(SumCommandsTest, WritesEachItem) {
  EXPECT_EQ(answer_to("write"), vector("write_answer"));
  EXPECT_THAT(memory.values[(Index{1, 2})], ElementsAre(0xBB));
}

TEST_F(SumCommandsTest, PacksWhatReadWriteReturned) {
  EXPECT_EQ(answer_to("read_write"), vector("read_write_answer"));
  EXPECT_THAT(memory.values[(Index{1, 1})], ElementsAre(1, 2, 3));
}

TEST_F(SumCommandsTest, ReturnsLengthsBesideSlots) {
  EXPECT_EQ(answer_to("read_with_lengths"), vector("read_with_lengths_answer"));
}

TEST_F(SumCommandsTest, PacksWhatWasRead) {
  EXPECT_EQ(answer_to("read_packed"), vector("read_packed_answer"));
}

TEST_F(SumCommandsTest, RefusesLengthsThatDoNotFitBeforeTheFirstItemIsDone) {
  for (const auto* name :
       {"more_items_than_written", "slots_larger_than_the_answer", "write_with_missing_data"}) {
    EXPECT_EQ(answer_to(name), encode_data(tl::make_unexpected(ErrorCode::invalid_size))) << name;
  }
  EXPECT_EQ(memory.calls, 0);
}

TEST_F(SumCommandsTest, ASumInASumFailsAsAnItem) {
  EXPECT_EQ(answer_to("sum_in_a_sum"), vector("sum_in_a_sum_answer"));
}

TEST_F(SumCommandsTest, PackedDataStaysWithinTheClientsLimit) {
  Bytes items;
  const auto request = vector("read_packed");
  items.assign(request.begin() + 16, request.end());
  const auto sum = sut.read_write(552, {sum::read_packed, 2}, 20, items);
  ASSERT_TRUE(sum);
  EXPECT_EQ(sum->size(), 20U);
}

TEST_F(SumCommandsTest, PassesOtherRequests) {
  EXPECT_TRUE(sut.has_port(552));
  EXPECT_FALSE(sut.has_port(553));
  EXPECT_THAT(*sut.read_write(552, {1, 2}, 8, Bytes{0xCC}), ElementsAre(0xAA));
  EXPECT_THAT(*sut.read(552, {1, 2}, 8), ElementsAre(0xCC));
  EXPECT_TRUE(sut.write(552, {1, 2}, Bytes{0xDD}));
  EXPECT_EQ(sut.info(552)->name, "memory");
  EXPECT_TRUE(sut.write_control(552, {6, 0}, {}));
  EXPECT_EQ(sut.state(552)->ads, 6);
}

}  // namespace
}  // namespace millrace::cnc::ads
