#include "gateway/live/done_commands.hpp"

#include <gtest/gtest.h>

namespace millrace::gateway::live {
namespace {

using namespace std::chrono_literals;

fabric::Outcome outcome() {
  return {.command = fabric::InstanceId::random(), .done = true, .detail = "given out again"};
}

TEST(DoneCommands, KnowsWhatCameOfACommand) {
  DoneCommands sut;
  const fabric::Outcome done = outcome();
  sut.note(done, {});
  ASSERT_NE(sut.find(done.command), nullptr);
  EXPECT_EQ(sut.find(done.command)->detail, "given out again");
  EXPECT_EQ(sut.find(fabric::InstanceId::random()), nullptr);
}

TEST(DoneCommands, ForgetsACommandThatNobodyRepeatsAnyMore) {
  DoneCommands sut;
  const fabric::Outcome old = outcome();
  const fabric::Outcome young = outcome();
  sut.note(old, DoneCommands::Moment{});
  sut.note(young, DoneCommands::Moment{} + DoneCommands::remembered);
  EXPECT_NE(sut.find(old.command), nullptr);
  sut.note(outcome(), DoneCommands::Moment{} + DoneCommands::remembered + 1s);
  EXPECT_EQ(sut.find(old.command), nullptr);
  EXPECT_NE(sut.find(young.command), nullptr);
}

TEST(DoneCommands, RemembersNoMoreThanAFloodMayCost) {
  DoneCommands sut;
  const fabric::Outcome first = outcome();
  sut.note(first, {});
  for (std::size_t i = 0; i < DoneCommands::most; ++i) {
    sut.note(outcome(), {});
  }
  EXPECT_EQ(sut.find(first.command), nullptr);
}

}  // namespace
}  // namespace millrace::gateway::live
