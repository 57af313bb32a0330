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

}  // namespace
}  // namespace millrace::tools::print
