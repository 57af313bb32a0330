#include "tools/commands/operate/operate.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::commands::operate {
namespace {

// A regression: a retry that succeeded ended with a colon.
TEST(TheResultOfACommand, IsNeverEmpty) {
  using enum fabric::CommandKind;
  EXPECT_EQ(result_text(retry, {.done = true}), "dispatched again");
  EXPECT_EQ(result_text(answer, {.done = true}), "done");
  EXPECT_EQ(result_text(retry, {.done = false}), "refused");
  EXPECT_EQ(result_text(retry, {.done = false, .detail = "no\ncall"}), "no\\x0acall");
}

}  // namespace
}  // namespace millrace::tools::commands::operate
