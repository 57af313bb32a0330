// Two gateways with the same machine: one serves, the other stands by.
#include <chrono>
#include <csignal>
#include <functional>
#include <stdexcept>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/cluster/history/execution_log.hpp"
#include "tests/integration/chain.hpp"
#include "tests/support/stuck_loop.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

const std::string machine =
    "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" ";

std::string standing_by(const Process& first) {
  return "cnc .*: gateway [0-9a-f]{12} \\(pid " + std::to_string(first.pid()) +
         " on \\S+\\) serves this machine already; this gateway stands by";
}

/// How often it has logged these words.
std::size_t times(const Process& process, const std::string& words) {
  const std::string log = process.error_output();
  std::size_t found = 0;
  for (auto at = log.find(words); at != std::string::npos; at = log.find(words, at + 1)) {
    ++found;
  }
  return found;
}

/// Whether it becomes true within the longest wait of a test.
bool eventually(const std::function<bool()>& holds) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > end) {
      return false;
    }
    std::this_thread::yield();
  }
  return true;
}

TEST(ASecondGateway, RefusesTheMachineAndNamesTheOneThatServesIt) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc();
  Process first = sut.gateway();
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  // It may have connected before: on a busy host the claim of the first one comes late.
  EXPECT_THAT(first.error_output(), Not(HasSubstr("stands by")));
  Process machines = sut.millrace({"machines"});
  EXPECT_EQ(machines.wait(), 0);
  EXPECT_THAT(machines.output(), HasSubstr("(pid " + std::to_string(first.pid()) + " on "));
  EXPECT_THAT(machines.output(), HasSubstr("serves this machine already"));
}

// While a call is under way: without a journal, a gateway that is killed while it writes an answer
// leaves a program that waits in vain.
TEST(ASecondGateway, TakesOverWhenTheFirstIsKilled) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"});
  Process first = sut.gateway({"--log-level", "debug"});
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  Process service = sut.slow_service({"--work", "1500"});
  first.await_error("cnc/1: call .* given to");
  first.kill();
  second.await_error("taken over: gateway [0-9a-f]{12} \\(pid " + std::to_string(first.pid()));
  Process third = sut.gateway();
  third.await_error(standing_by(second));
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("answer = first, state = 1\n"));
}

TEST(ASecondGateway, TakesOverWhenTheFirstEnds) {
  Chain sut;
  Process cnc = sut.cnc();
  Process first = sut.gateway();
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  first.terminate();
  EXPECT_EQ(first.wait(), 0);
  second.await_error("link up");
}

TEST(ASecondGateway, ServesTheChannelsThatTheFirstLeaves) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--run",
                         Chain::program(2, "square_root_of_3.nc"), "--exit-when-idle"});
  Process first = sut.configured_gateway(machine + "channel: 1 }", {"--log-level", "debug"});
  first.await_error("link up, channel 1");
  Process second = sut.gateway({"--log-level", "debug"});
  second.await_error("channel 1 is served by gateway .* already; this gateway stands by for it");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  first.await_error("cnc/1: call .* answered");
  second.await_error("cnc/2: call .* answered");
  EXPECT_THAT(second.error_output(), Not(HasSubstr("cnc/1: call")));
}

TEST(ASecondGateway, ReturnsTheMachineToTheFirstThatWasOnlyFrozen) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"});
  Process first = sut.gateway();
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  first.signal(SIGSTOP);
  second.await_error("taken over");
  second.await_error("link up");
  first.signal(SIGCONT);
  first.await_error("this gateway stood still");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] 200 calls, last 1.414214\n"));
  EXPECT_THAT(cnc.output(), Not(HasSubstr("failed")));
}

// DDS's own threads continue and announce that the process is alive.
TEST(ASecondGateway, TakesOverWhenTheLoopOfTheFirstHangsAndReturnsTheMachineWhenItRunsAgain) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"});
  Process first = sut.gateway({"--log-level", "debug"});
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  Process service = sut.slow_service({"--work", "1500"});
  first.await_error("cnc/1: call .* given to");
  {
    const StuckLoop stuck(first);
    second.await_error("taken over: gateway [0-9a-f]{12} \\(pid " + std::to_string(first.pid()));
    EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
    EXPECT_THAT(cnc.output(), HasSubstr("answer = first, state = 1\n"));
  }
  first.await_error("this gateway stood still");
  EXPECT_TRUE(eventually([&] { return times(second, "this gateway stands by") >= 2; }))
      << first.error_output() << "second:\n"
      << second.error_output();
}

TEST(ASecondGateway, BlocksAnAtMostOnceCallThatTheFirstHadDispatched) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"});
  Process first = sut.gateway({"--log-level", "debug"});
  first.await_error("link up");
  Process second = sut.gateway();
  second.await_error(standing_by(first));
  Process service = sut.slow_service({"--work", "100000", "--delivery", "at-most-once"});
  // The status of the channel came before the request.
  ASSERT_TRUE(eventually([&] { return cluster::read_executions(sut.record()).size() == 1; }));
  first.kill();
  second.await_error("cnc/1: call .*gateway .* is gone and may have dispatched this call");
  Process answer = sut.millrace({"answer", "cnc/1", "by hand", "--state", "7"});
  EXPECT_EQ(answer.wait(), 0) << answer.error_output();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("answer = by hand, state = 7"));
  EXPECT_EQ(cluster::read_executions(sut.record()).size(), 1U);
}

}  // namespace
}  // namespace millrace::tests::integration
