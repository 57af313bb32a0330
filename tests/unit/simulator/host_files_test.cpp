// Programs and report files of the virtual CNC on its host.
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cnc/simulator/program_folders.hpp"
#include "cnc/simulator/report_files.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::cnc::simulator {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::MatchesRegex;
using tests::TemporaryFolder;

void write(const std::filesystem::path& file, std::string_view text) {
  std::ofstream(file) << text;
}

std::string text_of(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

TEST(ProgramFolders, TakesTheFirstFolderThatHasTheFile) {
  const TemporaryFolder first;
  const TemporaryFolder second;
  write(second.path() / "a.nc", "second");
  ProgramFolders sut({first.path(), second.path()});
  EXPECT_EQ(sut.load("a.nc")->text, "second");
  write(first.path() / "a.nc", "first");
  EXPECT_EQ(sut.load("a.nc")->text, "first");
  EXPECT_EQ(sut.load("a.nc")->file, first.path() / "a.nc");
}

TEST(ProgramFolders, NamesTheFoldersItSearched) {
  ProgramFolders sut({"/one", "/two"});
  EXPECT_EQ(sut.load("a.nc").error(), "program a.nc is in none of the folders /one, /two");
}

TEST(ProgramFolders, TakesAnAbsoluteNameAsItIs) {
  const TemporaryFolder folder;
  write(folder.path() / "a.nc", "text");
  EXPECT_EQ(ProgramFolders({"/one"}).load((folder.path() / "a.nc").string())->text, "text");
}

TEST(ReadProgram, SaysWhyAFileCannotBeRead) {
  EXPECT_EQ(read_program("/no/such.nc").error(),
            "/no/such.nc cannot be read: No such file or directory");
  EXPECT_EQ(read_program("/tmp").error(), "/tmp cannot be read: it is a folder");
}

class ReportFile : public testing::Test {
 protected:
  TemporaryFolder folder_;
  ReportFiles sut_{folder_.path()};
  std::chrono::system_clock::time_point now_{std::chrono::milliseconds(1'767'225'600'123)};
};

TEST_F(ReportFile, GetsLinesInTheOrderTheyWereSaved) {
  ASSERT_TRUE(sut_.append({"message.txt", "one", false, true}, now_));
  ASSERT_TRUE(sut_.append({"message.txt", "two, ", false, false}, now_));
  ASSERT_TRUE(sut_.append({"message.txt", "three", false, true}, now_));
  EXPECT_EQ(text_of(folder_.path() / "message.txt"), "one\ntwo, three\n");
}

TEST_F(ReportFile, BeginsALineWithItsTimeWhereTheProgramWantsIt) {
  ASSERT_TRUE(sut_.append({"message.txt", "one", true, true}, now_));
  // The hour depends on the time zone of this host.
  EXPECT_THAT(text_of(folder_.path() / "message.txt"),
              MatchesRegex("20..-..-.. ..:.0:00\\.123 one\n"));
}

TEST_F(ReportFile, StaysInItsFolder) {
  for (const char* file : {"/tmp/message.txt", "../message.txt", "a/../../message.txt", ""}) {
    const auto written = sut_.append({file, "one", false, true}, now_);
    ASSERT_FALSE(written) << file;
    EXPECT_THAT(written.error(), AllOf(HasSubstr(file), HasSubstr("is outside of")));
  }
}

TEST_F(ReportFile, StandsInQuotationMarksIfAskedTo) {
  ReportFiles quoted(folder_.path(), {"", true});
  ASSERT_TRUE(quoted.append({"message.txt", "one", false, true}, now_));
  EXPECT_EQ(text_of(folder_.path() / "message.txt"), "\"one\"\n");
}

TEST_F(ReportFile, HasTheTimeStampItIsAskedFor) {
  ReportFiles stamped(folder_.path(), {"[%Y %f] ", false});
  ASSERT_TRUE(stamped.append({"message.txt", "one", true, true}, now_));
  EXPECT_THAT(text_of(folder_.path() / "message.txt"), MatchesRegex("\\[20[0-9]+ [0-9]+\\] one\n"));
}

TEST_F(ReportFile, ThatCannotBeWrittenIsReported) {
  const auto written = sut_.append({"no_such_folder/message.txt", "one", false, true}, now_);
  EXPECT_THAT(written.error(),
              HasSubstr("message.txt cannot be written: No such file or directory"));
}

}  // namespace
}  // namespace millrace::cnc::simulator
