// A service and a caller as of 1.0 (past_peer.c) beside the programs of today.
#include <csignal>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::compat {
namespace {

using integration::Chain;
using integration::Flags;
using testing::HasSubstr;
using testing::Not;

const std::string past_uuid = "a3c5b7d9-0e1f-4a2b-8c3d-4e5f60718293";
const std::string square_root = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class APeerOfThePast : public testing::Test {
 protected:
  Process start(const std::string& mode, const Flags& arguments) {
    Flags command{MILLRACE_PAST_PEER, mode, std::to_string(chain.domain())};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return Process(std::move(command));
  }
  Process service() {
    Process process = start("serve", {past_uuid});
    process.await("^ready: ");
    return process;
  }
  /// Each of its two channels makes this many calls.
  Process controller(std::uint32_t calls) {
    const std::string program = chain.counting_program(past_uuid, calls);
    return chain.cnc({"--run", "1=" + program, "--run", "2=" + program, "--exit-when-idle"});
  }
  static void expect_answered(Process& cnc, std::uint32_t calls) {
    EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
    for (const char* channel : {"[ch1] ", "[ch2] "}) {
      EXPECT_THAT(cnc.output(), HasSubstr(channel + std::to_string(calls) + " calls answered"));
    }
    EXPECT_THAT(cnc.output(), Not(HasSubstr("wrong answer")));
  }
  /// Both channels ask for the same numbers.
  static void expect_each_run_once(const Process& service, std::uint32_t calls) {
    std::map<std::string, int> runs;
    std::istringstream lines(service.output());
    for (std::string word, text; lines >> word >> text;) {
      runs[text] += word == "run" ? 1 : 0;
    }
    for (std::uint32_t call = 1; call <= calls; ++call) {
      EXPECT_EQ(runs[std::to_string(call)], 2) << "call " << call;
    }
  }

  Chain chain;
};

TEST_F(APeerOfThePast, AnswersTheCallsOfAGatewayOfToday) {
  Process sut = service();
  Process cnc = controller(50);
  Process gateway = chain.gateway();
  expect_answered(cnc, 50);
  Process listed = chain.millrace({"services"});
  EXPECT_EQ(listed.wait(), 0);
  EXPECT_THAT(listed.output(), HasSubstr(past_uuid));
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  expect_each_run_once(sut, 50);
}

TEST_F(APeerOfThePast, RunsNoCallTwiceForGatewaysOfTodayThatAreKilled) {
  chain.keep_state();
  Process sut = service();
  Process cnc = controller(150);
  for (const char* call : {"20", "60", "100"}) {
    Process gateway = chain.gateway();
    sut.await("^run " + std::string(call) + "$");
    gateway.kill();
  }
  Process gateway = chain.gateway();
  expect_answered(cnc, 150);
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  expect_each_run_once(sut, 150);
}

TEST_F(APeerOfThePast, CallsAServiceOfToday) {
  Process service = chain.square_root();
  Process sut = start("call", {square_root, "9", "16", "x"});
  EXPECT_EQ(sut.wait(), 0) << sut.error_output();
  EXPECT_THAT(sut.output(), testing::StartsWith("response = 3.000000, state = 1, code = 0\n"
                                                "response = 4.000000, state = 1, code = 0\n"));
}

}  // namespace
}  // namespace millrace::tests::compat
