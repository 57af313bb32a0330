#include "fabric/reply_keys.hpp"

#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

RequestKey reply_key(std::uint64_t epoch) {
  return {.key = {"cnc", 1}, .epoch = epoch, .instance = {}};
}

TEST(ReplyKeys, AdmitExpectedRepliesHoweverManyOthersThereAre) {
  ReplyKeys sut;
  for (std::uint64_t i = 0; i < ReplyKeys::most_others; ++i) {
    EXPECT_TRUE(sut.admits(reply_key(1000 + i)));
  }
  EXPECT_EQ(sut.dropped(), 0U);
  EXPECT_FALSE(sut.admits(reply_key(7)));
  sut.ask(reply_key(7));
  EXPECT_TRUE(sut.admits(reply_key(7)));
  EXPECT_TRUE(sut.admits(reply_key(1000))) << "a known key needs no room of its own";
  EXPECT_FALSE(sut.admits(reply_key(8)));
  EXPECT_EQ(sut.dropped(), 2U);
}

}  // namespace
}  // namespace millrace::fabric
