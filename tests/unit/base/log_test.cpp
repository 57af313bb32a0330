#include "base/program/log.hpp"

#include <cstdlib>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

namespace millrace::base::program {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::internal::CaptureStderr;
using testing::internal::GetCapturedStderr;

/// JOURNAL_STREAM as systemd sets it for standard error.
class JournalStream {
 public:
  JournalStream() {
    struct stat file {};
    ::fstat(STDERR_FILENO, &file);
    ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", file.st_dev, file.st_ino).c_str(), 1);
  }
  ~JournalStream() { ::unsetenv("JOURNAL_STREAM"); }
  JournalStream(const JournalStream&) = delete;
  JournalStream& operator=(const JournalStream&) = delete;
};

TEST(Log, IsALinePerEvent) {
  CaptureStderr();
  make_log("sut")->info("call {} seen", "5f3a-12");
  EXPECT_THAT(GetCapturedStderr(),
              testing::MatchesRegex("[-0-9]+T[:.0-9]+Z sut info  call 5f3a-12 seen\n"));
}

TEST(Log, EscapesTerminalControls) {
  CaptureStderr();
  make_log("sut")->warn("refused: {}", "\x1b[2J\a550 no");
  EXPECT_THAT(GetCapturedStderr(), HasSubstr("refused: \\x1b[2J\\x07550 no\n"));
}

TEST(Log, IndentsFurtherLinesOfForeignText) {
  CaptureStderr();
  make_log("sut")->warn("refused: {}", "550\n2026-03-01T07:00:00.123Z sut info  all is well");
  EXPECT_THAT(GetCapturedStderr(), HasSubstr("550\n    2026-03-01T07"));
}

TEST(Log, GivesTheJournalThePriorityOfEachLine) {
  CaptureStderr();
  {
    const JournalStream journal;
    const Log sut = make_log("sut");
    sut->error("broken\nin two lines");
    sut->warn("strange");
    sut->info("seen");
  }
  EXPECT_THAT(GetCapturedStderr(), ContainsRegex("^<3>20.* error broken\n<3>    in two lines\n"
                                                 "<4>20.* strange\n<6>20.* seen\n$"));
}

TEST(Log, HasNoPrioritiesOutsideTheJournal) {
  ::setenv("JOURNAL_STREAM", "1:2", 1);
  CaptureStderr();
  make_log("sut")->info("seen");
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_THAT(GetCapturedStderr(), testing::StartsWith("20"));
}

}  // namespace
}  // namespace millrace::base::program
