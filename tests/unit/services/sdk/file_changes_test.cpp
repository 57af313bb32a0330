#include "services/sdk/file_changes.hpp"

#include <gtest/gtest.h>

namespace millrace::services::sdk {
namespace {

using namespace std::chrono_literals;

class SettleTest : public testing::Test {
 protected:
  Settle::Time at(std::chrono::milliseconds after) { return Settle::Time{} + after; }
  Settle sut{500ms, "a", Settle::Time{}};
};

TEST_F(SettleTest, SeesNoChangeInWhatStays) {
  EXPECT_FALSE(sut.look("a", at(10s)));
}

TEST_F(SettleTest, ReportsAChangeOnceItHasBeenQuiet) {
  EXPECT_FALSE(sut.look("b", at(1000ms)));
  EXPECT_FALSE(sut.look("b", at(1499ms)));
  EXPECT_TRUE(sut.look("b", at(1500ms)));
}

TEST_F(SettleTest, ReportsAChangeOnce) {
  sut.look("b", at(1s));
  EXPECT_TRUE(sut.look("b", at(2s)));
  EXPECT_FALSE(sut.look("b", at(3s)));
}

TEST_F(SettleTest, WaitsWhileAFileIsBeingWritten) {
  for (int size = 0; size < 10; ++size) {
    EXPECT_FALSE(sut.look("b" + std::to_string(size), at(size * 400ms)));
  }
  EXPECT_TRUE(sut.look("b9", at(9 * 400ms + 500ms)));
}

TEST_F(SettleTest, ForgetsAChangeThatWasUndone) {
  EXPECT_FALSE(sut.look("b", at(1000ms)));
  EXPECT_FALSE(sut.look("a", at(1200ms)));
  EXPECT_FALSE(sut.look("a", at(9s)));
}

}  // namespace
}  // namespace millrace::services::sdk
