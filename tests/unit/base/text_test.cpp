#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/text/ascii.hpp"
#include "base/text/controls.hpp"
#include "base/text/cp1252.hpp"
#include "base/text/quoted.hpp"

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

TEST(Safe, EscapesWhatChangesTheOrderOfText) {
  // U+202E shows "cod.exe" as "exe.doc".
  for (const auto& [character, shown] : {std::pair{"\u061c", "\\u061c"},
                                         {"\u200e", "\\u200e"},
                                         {"\u200f", "\\u200f"},
                                         {"\u2028", "\\u2028"},
                                         {"\u202e", "\\u202e"},
                                         {"\u2066", "\\u2066"},
                                         {"\u2069", "\\u2069"}}) {
    EXPECT_EQ(safe(fmt::format("a{}b", character)), fmt::format("a{}b", shown));
  }
  EXPECT_EQ(safe("ع – 12 €…"), "ع – 12 €…");
}

TEST(Safe, KeepsTheGivenControls) {
  EXPECT_EQ(safe("one\n\ttwo", "\n"), "one\n\\x09two");
}

TEST(CsvCell, IsQuotedWhereItMustBe) {
  EXPECT_EQ(csv_cell("plain text; 1.5"), "\"plain text; 1.5\"");
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
  EXPECT_EQ(csv_cell(" =1+1"), "' =1+1");
  EXPECT_EQ(csv_cell("\xef\xbc\x9d"
                     "1+1"),
            "'\xef\xbc\x9d"
            "1+1");
  EXPECT_EQ(csv_cell(";=1+1"), "\";'=1+1\"");
  EXPECT_EQ(csv_cell("a;-5; @x;"), "\"a;-5;' @x;\"");
  for (const char* const number : {"-12.5", "-3", "-1e-05", "7"}) {
    EXPECT_EQ(csv_cell(number), number);
  }
}

TEST(ShellWord, IsQuotedWhereAShellWouldChangeIt) {
  EXPECT_EQ(shell_word("/etc/millrace/fabric.textproto"), "/etc/millrace/fabric.textproto");
  EXPECT_EQ(shell_word("hall 3's"), R"('hall 3'\''s')");
  EXPECT_EQ(shell_word(""), "''");
}

TEST(XmlText, EscapesTheCharactersOfXml) {
  EXPECT_EQ(xml_text("R&D <\"a\" 'b'> M\u00fcnchen"),
            "R&amp;D &lt;&quot;a&quot; &apos;b&apos;&gt; M\u00fcnchen");
}

TEST(EditDistance, CountsInsertionsRemovalsAndReplacements) {
  EXPECT_EQ(edit_distance("", "abc"), 3U);
  EXPECT_EQ(edit_distance("abc", "abc"), 0U);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3U);
}

TEST(Cp1252, BecomesUtf8) {
  EXPECT_EQ(to_utf8("Ma\xDF \x80 \x96"), "Maß € –");
}

TEST(Cp1252, SurvivesTheConversionToUtf8AndBack) {
  std::string all;
  for (int byte = 0; byte < 256; ++byte) {
    all += static_cast<char>(byte);
  }
  EXPECT_EQ(to_cp1252(to_utf8(all)), all);
}

TEST(Cp1252, RefusesACharacterItHasNoByteFor) {
  EXPECT_EQ(to_cp1252("ab中").error(), "U+4E2D at byte 3 is not in CP1252");
  EXPECT_EQ(to_cp1252("\xF0\x9F\x98\x80").error(), "U+1F600 at byte 1 is not in CP1252");
}

/// U+0080 is a control in Unicode; the byte 80 is the euro sign.
TEST(Utf8, IsMoreThanCp1252) {
  EXPECT_TRUE(is_utf8(""));
  EXPECT_TRUE(is_utf8("Maß 中 \xF0\x9F\x98\x80"));
}

TEST(Cp1252, RefusesAControlCharacterWhoseCodeIsTaken) {
  EXPECT_FALSE(to_cp1252("\xC2\x80"));
}

class NotUtf8 : public testing::TestWithParam<std::string_view> {};

TEST_P(NotUtf8, IsRefusedWithItsPlace) {
  EXPECT_EQ(to_cp1252("x" + std::string(GetParam())).error(), "byte 2 is not UTF-8");
  EXPECT_FALSE(is_utf8("x" + std::string(GetParam())));
}

INSTANTIATE_TEST_SUITE_P(Broken, NotUtf8,
                         testing::Values("\xDF",              // CP1252
                                         "\x80",              // a continuation alone
                                         "\xC3",              // truncated
                                         "\xC0\xAF",          // overlong form of '/'
                                         "\xE0\x80\xAF",      // the same in three bytes
                                         "\xF0\x80\x80\xAF",  // the same in four
                                         "\xED\xA0\x80",      // a surrogate
                                         "\xF4\x90\x80\x80",  // beyond Unicode
                                         "\xC3\x28"));        // no continuation

}  // namespace
}  // namespace millrace::base::text
