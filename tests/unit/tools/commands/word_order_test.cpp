#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/commands/subcommand.hpp"

namespace millrace::tools::commands {
namespace {

using testing::ElementsAre;

TEST(WordOrder, TakesHelpAndVersionForTheirOptions) {
  EXPECT_THAT(word_order({"help"}), ElementsAre("--help"));
  EXPECT_THAT(word_order({"help", "recording", "info"}),
              ElementsAre("recording", "info", "--help"));
  EXPECT_THAT(word_order({"version"}), ElementsAre("--version"));
}

TEST(TheArguments, HaveGlobalOptionsBehindTheCommand) {
  EXPECT_THAT(word_order({"--domain", "7", "--json", "services", "x"}),
              ElementsAre("services", "x", "--domain", "7", "--json"));
  EXPECT_THAT(word_order({"--fabric=hall", "machines"}), ElementsAre("machines", "--fabric=hall"));
  EXPECT_THAT(word_order({"--domain", "7", "call", "x", "--", "-1"}),
              ElementsAre("call", "x", "--domain", "7", "--", "-1"));
  EXPECT_THAT(word_order({"services", "--domain", "7"}), ElementsAre("services", "--domain", "7"));
}

TEST(TheArguments, AreStatusWhereThereIsNoCommand) {
  EXPECT_THAT(word_order({}), ElementsAre("status"));
  EXPECT_THAT(word_order({"--domain", "7"}), ElementsAre("status", "--domain", "7"));
  EXPECT_THAT(word_order({"--expect-gateway", "press"}),
              ElementsAre("status", "--expect-gateway", "press"));
  EXPECT_THAT(word_order({"--domain"}), ElementsAre("status", "--domain"));
}

TEST(TheArguments, HaveTheMachineBeforeTheCommandOfVars) {
  EXPECT_THAT(word_order({"--domain", "7", "vars", "read", "press", "V.E.X"}),
              ElementsAre("vars", "press", "read", "V.E.X", "--domain", "7"));
  EXPECT_THAT(word_order({"vars", "list", "list"}), ElementsAre("vars", "list", "list"));
  EXPECT_THAT(word_order({"vars", "list", "--help"}), ElementsAre("vars", "list", "--help"));
}

TEST(TheArguments, StayWhereTheyAreAboutTheProgramItself) {
  EXPECT_THAT(word_order({"--help"}), ElementsAre("--help"));
  EXPECT_THAT(word_order({"--completion", "bash"}), ElementsAre("--completion", "bash"));
}

}  // namespace
}  // namespace millrace::tools::commands
