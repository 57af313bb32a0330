// `millrace calls -f` with the real programs, into a pipe and on a terminal.

#include <algorithm>
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/terminal.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

class Watching : public testing::Test {
 protected:
  /// Starts programs in both channels with continuous calls.
  void start_calls() {
    service.emplace(chain.square_root({"--name", "sq1"}));
    cnc.emplace(chain.cnc({"--run", Chain::program(1, "endless_calls.nc"), "--run",
                           Chain::program(2, "endless_calls.nc")}));
    gateway.emplace(chain.gateway());
  }

  Chain chain;
  std::optional<Process> service;
  std::optional<Process> cnc;
  std::optional<Process> gateway;
};

TEST_F(Watching, PrintsALineForEachCallIntoAPipe) {
  start_calls();
  Process sut = chain.millrace({"calls", "-f"});
  // The instance's name appears once its identity is known.
  sut.await("cnc/1  560aacbf-.*  \"2\" [0-9]+ -> \"1.414214\" 1  .*s  sq1 on ");
  sut.await("cnc/2");
  sut.signal(SIGINT);
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), Not(HasSubstr("\x1b")));
}

TEST_F(Watching, EndsAfterSoManyCalls) {
  start_calls();
  Process sut = chain.millrace({"calls", "-f", "--count", "20"});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  const std::string lines = sut.output();
  EXPECT_EQ(std::count(lines.begin(), lines.end(), '\n'), 20);
}

TEST_F(Watching, PrintsOnlyTheSelectedCalls) {
  start_calls();
  Process of_a_channel = chain.millrace({"calls", "-f", "--channel", "2", "--json"});
  of_a_channel.await("\"channel\":2,");
  of_a_channel.await("\"name\":\"sq1\"");
  of_a_channel.signal(SIGINT);
  EXPECT_EQ(of_a_channel.wait(), 0);
  EXPECT_THAT(of_a_channel.output(), Not(HasSubstr("\"channel\":1,")));

  Process of_unknown = chain.millrace({"calls", "-f", "--uuid", "unknown", "--lines"});
  Process of_all = chain.millrace({"calls", "-f", "--count", "10"});
  EXPECT_EQ(of_all.wait(), 0);
  of_unknown.signal(SIGINT);
  EXPECT_EQ(of_unknown.wait(), 0);
  EXPECT_EQ(of_unknown.output(), "");
}

TEST_F(Watching, ShowsATableWithRatesOnATerminalAndRestoresItAtCtrlC) {
  if (const std::string reason = Terminal::obstacle(); !reason.empty()) {
    GTEST_SKIP() << reason;
  }
  start_calls();
  Terminal sut(chain.command({"calls", "-f"}), {.rows = 12, .columns = 160});
  sut.await("CALLS/S");
  sut.await("cnc/2");
  sut.await("sq1 on");
  sut.type("\x03");
  EXPECT_EQ(sut.wait(), 0) << sut.output();
  // The alternate screen, and back again.
  EXPECT_THAT(sut.output(), testing::StartsWith("\x1b[?1049h"));
  EXPECT_THAT(sut.output(), HasSubstr("\x1b[?25h\x1b[?1049l"));
}

TEST_F(Watching, PrintsLinesOnATerminalOnRequest) {
  if (const std::string reason = Terminal::obstacle(); !reason.empty()) {
    GTEST_SKIP() << reason;
  }
  start_calls();
  Terminal sut(chain.command({"calls", "-f", "--lines", "--count", "3"}), {});
  EXPECT_EQ(sut.wait(), 0) << sut.output();
  EXPECT_THAT(sut.output(), Not(HasSubstr("\x1b")));
  EXPECT_EQ(std::count(sut.output().begin(), sut.output().end(), '\n'), 3);
}

}  // namespace
}  // namespace millrace::tests::integration
