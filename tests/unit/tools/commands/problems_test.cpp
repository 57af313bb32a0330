#include "tools/commands/status/problems.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/command_line.hpp"
#include "tests/unit/tools/commands/small_fabric.hpp"

namespace millrace::tools::commands::status {
namespace {

using namespace tests;
using namespace std::chrono_literals;
using fabric::ChannelState;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class Problems : public testing::Test {
 protected:
  Problems() { sut.add(machine("press", true)); }

  std::vector<std::string> kinds(fabric::Time now = at(0)) {
    found = problems_of(sut, now);
    sort(found);
    std::vector<std::string> words;
    for (const Problem& problem : found) {
      words.push_back(problem.kind + " " + problem.subject);
    }
    return words;
  }

  bus::FabricModel sut;
  std::vector<Problem> found;
};

TEST_F(Problems, AreNoneWhereAllIsWell) {
  sut.add(news(1, "a"));
  sut.add(channel(1, ChannelState::running, square_root));
  EXPECT_THAT(kinds(), IsEmpty());
  EXPECT_EQ(exit_code_of(found), 0);
}

TEST_F(Problems, HaveTheWorstFirstAndOfEqualsTheOldest) {
  sut.add(channel(1, ChannelState::unserved, square_root));
  sut.add(channel(2, ChannelState::held, square_root, at(2000)));
  sut.add(channel(3, ChannelState::held, square_root, at(1000)));
  sut.add(machine("mill", false));
  EXPECT_THAT(kinds(),
              ElementsAre("LINK DOWN mill", "HELD press/3", "HELD press/2", "NO SERVICE press/1"));
  EXPECT_EQ(exit_code_of(found), exit_link_down);
  EXPECT_THAT(found[1].advice, HasSubstr("'millrace retry press/3'"));
}

TEST_F(Problems, HaveCommandsForTheirFabric) {
  sut.add(channel(3, ChannelState::held, square_root));
  const auto problems = problems_of(sut, at(0), " --domain 7 --fabric 'hall 3'");
  ASSERT_EQ(problems.size(), 1U);
  EXPECT_EQ(problems[0].advice,
            "check the machine, then 'millrace answer press/3 --domain 7 --fabric 'hall 3' TEXT "
            "--state N' or 'millrace retry press/3 --domain 7 --fabric 'hall 3''");
}

TEST_F(Problems, AreCallsThatWaitLongerThanAMinuteForAFreeInstance) {
  sut.add(news(1, "a"));
  sut.add(channel(1, ChannelState::waiting, square_root));
  EXPECT_THAT(kinds(at(0) + 59s), IsEmpty());
  EXPECT_THAT(kinds(at(0) + 61s), ElementsAre("WAITING press/1"));
  EXPECT_EQ(exit_code_of(found), exit_unserved);
}

TEST_F(Problems, AreWarningsLastAndWithoutAnExitCode) {
  sut.add(fabric::Alarm{.key = {instance(7), "certificate", ""},
                        .level = fabric::AlarmLevel::warning,
                        .text = "ends soon",
                        .program = "mail",
                        .host = "vm",
                        .pid = 7});
  EXPECT_THAT(kinds(), ElementsAre("WARNING mail on vm, pid 7"));
  EXPECT_EQ(exit_code_of(found), 0);
  sut.add(fabric::Alarm{.key = {instance(8), "archive", ""},
                        .level = fabric::AlarmLevel::problem,
                        .text = "disk full",
                        .program = "archiver",
                        .host = "vm",
                        .pid = 8});
  EXPECT_THAT(kinds(), ElementsAre("ALARM archiver on vm, pid 8", "WARNING mail on vm, pid 7"));
  EXPECT_EQ(exit_code_of(found), exit_alarm);
}

TEST_F(Problems, AreAFabricWithoutAGateway) {
  sut = {};
  EXPECT_THAT(kinds(), ElementsAre("NO GATEWAY -"));
  EXPECT_EQ(exit_code_of(found), exit_link_down);
}

TEST_F(Problems, AreOfAMachineWithTwoGatewaysOnlyIfNeitherHasTheLink) {
  sut.add({.sample = fabric::MachineStatus{
               .machine = "press", .gateway = instance(98), .connected = false, .host = "other"}});
  EXPECT_THAT(kinds(), IsEmpty());
}

TEST_F(Problems, AreExpectedGatewaysAndInstancesThatAreMissing) {
  sut.add(news(1, "a"));
  EXPECT_THAT(missing_gateways(sut, {"press", "vm"}), IsEmpty());
  EXPECT_THAT(missing_gateways(sut, {"mill"}), testing::SizeIs(1));
  EXPECT_THAT(missing_instances(sut, {{square_root, 1}, {"a", 1}}), IsEmpty());
  const auto missing = missing_instances(sut, {{square_root, 2}});
  ASSERT_THAT(missing, testing::SizeIs(1));
  EXPECT_EQ(missing[0].text, "1 of 2 expected instances");
}

}  // namespace
}  // namespace millrace::tools::commands::status
