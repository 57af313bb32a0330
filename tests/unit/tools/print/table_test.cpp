#include "tools/print/table.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::print {
namespace {

TEST(ALine, IsBrokenAtBlanksWhereItIsTooLong) {
  EXPECT_EQ(wrapped("HELD  Maß is lost, retry it", 80, 6), "HELD  Maß is lost, retry it\n");
  EXPECT_EQ(wrapped("HELD  Maß is lost, retry it", 20, 6),
            "HELD  Maß is lost,\n"
            "      retry it\n");
  EXPECT_EQ(wrapped("HELD  Maß is lost, retry it", 12, 6),
            "HELD  Maß is\n"
            "      lost,\n"
            "      retry\n"
            "      it\n");
  EXPECT_EQ(wrapped("HELD  Maß is lost, retry it", 0, 6), "HELD  Maß is lost, retry it\n");
  EXPECT_EQ(wrapped("a longer_than_a_line", 8, 2), "a\n  longer_than_a_line\n");
}

}  // namespace
}  // namespace millrace::tools::print
