// NC programs and report files of the virtual CNC on its host.
#include "cnc/simulator/host_files.hpp"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/sinks/null_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

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

TEST(ProgramFolders, UsesTheFirstFolderThatHasTheFile) {
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

TEST(ProgramFolders, AcceptsAnAbsoluteNameBeneathOneOfThem) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "sub");
  write(folder.path() / "sub/a.nc", "text");
  const std::string name = (folder.path() / "sub/a.nc").string();
  EXPECT_EQ(ProgramFolders({"/one", folder.path()}).load(name)->text, "text");
  EXPECT_FALSE(ProgramFolders({"/one"}).load(name));
}

TEST(ProgramFolders, IgnoresTheCaseOfAName) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder.path() / "Sub");
  write(folder.path() / "Sub/Drill.cyc", "mixed");
  ProgramFolders sut({folder.path()});
  EXPECT_EQ(sut.load("SUB/drill.CYC")->text, "mixed");
  EXPECT_EQ(sut.load("SUB/drill.CYC")->file, folder.path() / "Sub/Drill.cyc");
  write(folder.path() / "Sub/drill.cyc", "lower");
  EXPECT_EQ(sut.load("sub/drill.cyc")->text, "lower");
  EXPECT_EQ(sut.load("sub/DRILL.CYC")->text, "mixed");  // the first in alphabetical order
}

TEST(ProgramFolders, ReadsNothingOutsideOfThem) {
  const TemporaryFolder folder;
  const TemporaryFolder other;
  write(other.path() / "secret", "secret");
  std::filesystem::create_symlink(other.path() / "secret", folder.path() / "link.nc");
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.nc").c_str(), 0600), 0);
  ProgramFolders sut({folder.path()});
  for (const std::string& name :
       {std::string("/proc/self/environ"), "../" + other.path().filename().string() + "/secret",
        (other.path() / "secret").string(), std::string("link.nc"), std::string("pipe.nc"),
        std::string(".")}) {
    EXPECT_FALSE(sut.load(name)) << name;
  }
  EXPECT_THAT(sut.load("link.nc").error(), HasSubstr("a symbolic link"));
}

TEST(ReadProgram, RefusesOneThatIsTooLongBeforeItIsRead) {
  const TemporaryFolder folder;
  write(folder.path() / "long.nc", "");
  std::filesystem::resize_file(folder.path() / "long.nc", 1ULL << 30U);
  EXPECT_THAT(read_program(folder.path() / "long.nc").error(),
              HasSubstr("it has 1073741824 bytes; an NC program has at most 67108864"));
  EXPECT_THAT(ProgramFolders({folder.path()}).load("long.nc").error(), HasSubstr("at most"));
}

TEST(ReadProgram, WaitsForNoPipe) {
  const TemporaryFolder folder;
  ASSERT_EQ(::mkfifo((folder.path() / "pipe.nc").c_str(), 0600), 0);
  EXPECT_THAT(read_program(folder.path() / "pipe.nc").error(), HasSubstr("not a regular file"));
}

TEST(ReadProgram, ReportsWhyAFileCannotBeRead) {
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

TEST_F(ReportFile, BeginsALineWithItsTimeOnRequest) {
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

TEST_F(ReportFile, IsNeitherALinkNorAPipeNorHidden) {
  const TemporaryFolder other;
  write(other.path() / "keys", "");
  std::filesystem::create_symlink(other.path() / "keys", folder_.path() / "link");
  ASSERT_EQ(::mkfifo((folder_.path() / "pipe").c_str(), 0600), 0);
  for (const char* file : {"link", "pipe", ".profile"}) {
    EXPECT_FALSE(sut_.append({file, "one", false, true}, now_)) << file;
  }
  EXPECT_EQ(text_of(other.path() / "keys"), "");
}

TEST_F(ReportFile, HasATimeStampWithMilliseconds) {
  ASSERT_TRUE(sut_.append({"message.txt", "one", true, true}, now_));
  EXPECT_THAT(
      text_of(folder_.path() / "message.txt"),
      MatchesRegex("20[0-9]{2}-[0-9]{2}-[0-9]{2} [0-9]{2}:[0-9]{2}:[0-9]{2}[.][0-9]{3} one\n"));
}

TEST_F(ReportFile, ThatCannotBeWrittenIsReported) {
  const auto written = sut_.append({"no_such_folder/message.txt", "one", false, true}, now_);
  EXPECT_THAT(written.error(), AllOf(HasSubstr("no_such_folder/message.txt"),
                                     HasSubstr("No such file or directory")));
}

// The file with the routes of a virtual CNC.

class RouteFile : public testing::Test {
 protected:
  std::shared_ptr<ads::Routes> read() { return read_routes(file, log); }
  [[nodiscard]] std::string text() const {
    std::ostringstream all;
    all << std::ifstream(file).rdbuf();
    return all.str();
  }

  tests::TemporaryFolder folder;
  std::filesystem::path file = folder.path() / "routes";
  base::program::Log log =
      std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::null_sink_mt>());
};

TEST_F(RouteFile, IsEmptyWhileItDoesNotExist) {
  EXPECT_THAT(read()->all(), testing::IsEmpty());
}

TEST_F(RouteFile, KeepsItsRoutesWhenAnotherOneIsAdded) {
  std::ofstream(file) << "192.168.10.20.1.1\n";
  const auto sut = read();
  ASSERT_EQ(sut->all().size(), 1U);
  sut->add({*ads::NetId::parse("192.168.10.21.1.1"), ""});
  EXPECT_THAT(text(), HasSubstr("192.168.10.20.1.1"));
  EXPECT_THAT(text(), HasSubstr("192.168.10.21.1.1"));
}

TEST_F(RouteFile, ThatCannotBeReadIsAnErrorAndNotEmpty) {
  std::filesystem::create_directory(file);
  try {
    read();
    FAIL() << "a folder is not a file of routes";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("routes: the file of routes cannot be read"));
  }
}

}  // namespace
}  // namespace millrace::cnc::simulator
