#include "fabric/wire/key_limit.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric::wire {
namespace {

TEST(KeyLimit, KeepsSoManyKeysOfEachWriterAndNamesWhoHasMore) {
  KeyLimit sut(2);
  EXPECT_TRUE(sut.admits(1, 11));
  EXPECT_TRUE(sut.admits(1, 12));
  EXPECT_EQ(sut.take_flooding(), std::nullopt);
  EXPECT_FALSE(sut.admits(1, 13));
  EXPECT_TRUE(sut.admits(1, 12));
  EXPECT_TRUE(sut.admits(2, 13)) << "another one has room of its own";
  EXPECT_EQ(sut.take_flooding(), 1U);
  EXPECT_EQ(sut.take_flooding(), std::nullopt);
}

TEST(KeyLimit, ForgetsTheFirstOfTooManyWriters) {
  KeyLimit sut(1);
  for (dds_instance_handle_t writer = 1; writer <= KeyLimit::most_writers + 1; ++writer) {
    EXPECT_TRUE(sut.admits(writer, 7));
  }
  EXPECT_FALSE(sut.admits(2, 8));
  EXPECT_TRUE(sut.admits(1, 8));
}

}  // namespace
}  // namespace millrace::fabric::wire
