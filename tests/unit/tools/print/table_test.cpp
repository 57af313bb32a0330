#include "tools/print/table.hpp"

#include <gtest/gtest.h>

namespace millrace::tools::print {
namespace {

TEST(Table, AlignsColumns) {
  Table sut({{"NAME"}, {"CALLS", Align::right}, {"WHY"}});
  sut.add({"Maß", "7", ""});
  sut.add({"square_root", "12345", "busy"});
  EXPECT_EQ(sut.text(),
            "NAME         CALLS  WHY\n"
            "Maß              7\n"
            "square_root  12345  busy\n");
}

TEST(Table, EscapesTerminalControls) {
  Table sut({{"HOST"}});
  sut.add({"\x1b[2Jplc\n"});
  EXPECT_EQ(sut.text(), "HOST\n\\x1b[2Jplc\\x0a\n");
}

TEST(Table, HasATitleLineOnly) {
  const Table sut({{"NAME"}, {"WHY"}});
  EXPECT_TRUE(sut.empty());
  EXPECT_EQ(sut.text(), "NAME  WHY\n");
}

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
