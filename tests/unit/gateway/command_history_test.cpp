#include "gateway/shell/command_history.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway::shell {
namespace {

using namespace std::chrono_literals;

fabric::Outcome outcome() {
  return {.command = fabric::InstanceId::random(), .done = true, .detail = "dispatched again"};
}

TEST(CommandHistory, RemembersTheOutcomeOfACommand) {
  CommandHistory sut;
  const fabric::Outcome done = outcome();
  sut.add(done, {});
  ASSERT_NE(sut.find(done.command), nullptr);
  EXPECT_EQ(sut.find(done.command)->detail, "dispatched again");
  EXPECT_EQ(sut.find(fabric::InstanceId::random()), nullptr);
}

TEST(CommandHistory, ForgetsACommandAfterItsTime) {
  CommandHistory sut;
  const fabric::Outcome old = outcome();
  const fabric::Outcome young = outcome();
  sut.add(old, CommandHistory::Moment{});
  sut.add(young, CommandHistory::Moment{} + CommandHistory::remembered);
  EXPECT_NE(sut.find(old.command), nullptr);
  sut.add(outcome(), CommandHistory::Moment{} + CommandHistory::remembered + 1s);
  EXPECT_EQ(sut.find(old.command), nullptr);
  EXPECT_NE(sut.find(young.command), nullptr);
}

TEST(CommandHistory, LimitsItsSizeDuringAFlood) {
  CommandHistory sut;
  const fabric::Outcome first = outcome();
  sut.add(first, {});
  for (std::size_t i = 0; i < CommandHistory::most; ++i) {
    sut.add(outcome(), {});
  }
  EXPECT_EQ(sut.find(first.command), nullptr);
}

}  // namespace
}  // namespace millrace::gateway::shell
