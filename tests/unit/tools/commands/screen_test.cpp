#include "tools/commands/screen.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::commands {
namespace {

TEST(FirstLines, AreAllWhereTheyFit) {
  EXPECT_EQ(first_lines("a\nb\n", 2), "a\nb\n");
  EXPECT_EQ(first_lines("a\nb\n", 9), "a\nb\n");
  EXPECT_EQ(first_lines("", 2), "");
}

TEST(FirstLines, EndWithTheNumberOfThoseThatDoNotFit) {
  EXPECT_EQ(first_lines("a\nb\nc\nd\n", 3), "a\nb\n… and 2 lines more\n");
  EXPECT_EQ(first_lines("a\nb\nc\n", 1), "… and 3 lines more\n");
  EXPECT_EQ(first_lines("a\nb\n", 0), "");
}

}  // namespace
}  // namespace millrace::tools::commands
