#include "base/program/log.hpp"

#include <array>
#include <cstdlib>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/logger.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/program/retrying_sink.hpp"
#include "tests/support/await.hpp"

namespace millrace::base::program {
namespace {

using testing::ContainsRegex;
using testing::ElementsAre;
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

/// A pipe of one page, which is full after a hundred lines.
class RetryingSinkTest : public testing::Test {
 protected:
  RetryingSinkTest() {
    EXPECT_EQ(::pipe2(ends_.data(), O_CLOEXEC), 0);
    EXPECT_GT(::fcntl(ends_[1], F_SETPIPE_SZ, 4096), 0);
  }
  ~RetryingSinkTest() override {
    log.reset();
    ::close(ends_[0]);
    ::close(ends_[1]);
  }

  void open(std::size_t room) {
    auto sut = std::make_shared<RetryingSink>(ends_[1], room);
    sut->set_pattern("%v");
    log = std::make_shared<spdlog::logger>("test", std::move(sut));
  }
  /// Logs the lines 0, 1 …, each 40 bytes long; in a thread, so that a blocking sink is noticed.
  void fill(int lines) {
    auto filled = std::async(std::launch::async, [&] {
      for (int i = 0; i < lines; ++i) {
        log->info("{:039}", i);
      }
    });
    const bool in_time = filled.wait_for(tests::await_limit) == std::future_status::ready;
    EXPECT_TRUE(in_time) << "the logging thread waits for the reader";
    if (!in_time) {
      read_lines(lines);
    }
  }
  /// Reads this number of whole lines.
  std::vector<std::string> read_lines(int wanted) {
    std::vector<std::string> lines;
    std::array<char, 1000> chunk{};
    while (static_cast<int>(lines.size()) < wanted) {
      const ssize_t size = ::read(ends_[0], chunk.data(), chunk.size());
      if (size <= 0) {
        break;
      }
      for (const char c : std::string_view(chunk.data(), static_cast<std::size_t>(size))) {
        if (c == '\n') {
          lines.push_back(std::exchange(begun_, {}));
        } else {
          begun_ += c;
        }
      }
    }
    return lines;
  }

  std::shared_ptr<spdlog::logger> log;

 private:
  std::array<int, 2> ends_{};
  std::string begun_;
};

TEST_F(RetryingSinkTest, WritesALineBeforeTheCallReturns) {
  open(1'000'000);
  log->info("a line");
  EXPECT_THAT(read_lines(1), ElementsAre("a line"));
}

TEST_F(RetryingSinkTest, KeepsWhatAStalledReaderDoesNotRead) {
  constexpr int lines = 10'000;
  open(1'000'000);
  fill(lines);
  const auto read = read_lines(lines);
  ASSERT_EQ(read.size(), static_cast<std::size_t>(lines));
  for (int i = 0; i < lines; ++i) {
    ASSERT_EQ(read[static_cast<std::size_t>(i)], fmt::format("{:039}", i));
  }
  log->info("and on");
  EXPECT_THAT(read_lines(1), ElementsAre("and on"));
}

TEST_F(RetryingSinkTest, CountsDroppedLinesAndReportsThemInTheirPlace) {
  constexpr int lines = 10'000;
  open(40'000);
  fill(lines);
  std::vector<std::string> read;
  while (read.empty() || read.back().find("missing") == std::string::npos) {
    const auto some = read_lines(1);
    ASSERT_FALSE(some.empty());
    read.insert(read.end(), some.begin(), some.end());
  }
  const std::size_t whole = read.size() - 1;
  EXPECT_GE(whole, 1000U);
  EXPECT_EQ(read[whole - 1], fmt::format("{:039}", whole - 1));
  EXPECT_THAT(read.back(), HasSubstr(fmt::format("{} log lines are missing", lines - whole)));
}

TEST_F(RetryingSinkTest, DoesNotWaitLongAtTheEndForAReaderThatNeverReads) {
  open(1'000'000);
  fill(1000);
  auto ended = std::async(std::launch::async, [&] { log.reset(); });
  EXPECT_EQ(ended.wait_for(tests::await_limit), std::future_status::ready);
}

}  // namespace
}  // namespace millrace::base::program
