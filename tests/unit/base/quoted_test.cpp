#include "base/text/quoted.hpp"

#include <gtest/gtest.h>

namespace millrace::base::text {
namespace {

TEST(Quoted, ShowsCp1252AsUtf8) {
  EXPECT_EQ(quoted("Ma\xDF 1\x80"), "\"Maß 1€\"");
}

TEST(Quoted, EscapesTerminalControls) {
  EXPECT_EQ(quoted("\x1b[2J\n\x7f\x90"), "\"\\x1b[2J\\x0a\\x7f\\x90\"");
  EXPECT_EQ(safe("host\x1b]0;x\a"), "host\\x1b]0;x\\x07");
}

TEST(Quoted, CanBeReadBack) {
  EXPECT_EQ(quoted("a \"b\" \\ c"), R"("a \"b\" \\ c")");
}

TEST(Safe, KeepsUtf8AndEscapesOtherBytes) {
  EXPECT_EQ(safe("Maß"), "Maß");
  EXPECT_EQ(safe("Ma\xDF"), "Ma\\xdf");
}

TEST(Safe, EscapesControlsOfTheUpperHalf) {
  // U+009B begins a control sequence as ESC [ does.
  EXPECT_EQ(safe("a\xc2\x9b"
                 "2Jß\xc2\xa0"),
            "a\\x9b2Jß\xc2\xa0");
}

TEST(Safe, KeepsTheGivenControls) {
  EXPECT_EQ(safe("one\n\ttwo", "\n"), "one\n\\x09two");
}

TEST(CsvCell, IsQuotedWhereItMustBe) {
  EXPECT_EQ(csv_cell("plain text; 1.5"), "plain text; 1.5");
  EXPECT_EQ(csv_cell("a,b"), "\"a,b\"");
  EXPECT_EQ(csv_cell("say \"a\""), "\"say \"\"a\"\"\"");
}

TEST(CsvCell, HasNoControlCharacter) {
  EXPECT_EQ(csv_cell("one\r\ntwo\x1b[2J"), "one\\x0d\\x0atwo\\x1b[2J");
  EXPECT_EQ(csv_cell("Ma\xc3\x9f"), "Ma\xc3\x9f");
}

TEST(CsvCell, IsNoFormula) {
  EXPECT_EQ(csv_cell("=HYPERLINK(\"http://x\",\"y\")"),
            "\"'=HYPERLINK(\"\"http://x\"\",\"\"y\"\")\"");
  EXPECT_EQ(csv_cell("+1+cmd|' /C calc'!A0"), "'+1+cmd|' /C calc'!A0");
  EXPECT_EQ(csv_cell("@SUM(A1)"), "'@SUM(A1)");
  EXPECT_EQ(csv_cell("-2-3"), "'-2-3");
  for (const char* const number : {"-12.5", "-3", "-1e-05", "7"}) {
    EXPECT_EQ(csv_cell(number), number);
  }
}

TEST(XmlText, EscapesTheCharactersOfXml) {
  EXPECT_EQ(xml_text("R&D <\"a\" 'b'> M\u00fcnchen"),
            "R&amp;D &lt;&quot;a&quot; &apos;b&apos;&gt; M\u00fcnchen");
}

}  // namespace
}  // namespace millrace::base::text
