#include "gateway/settings/settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/command_line.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"

namespace millrace::gateway {
namespace {

using base::program::UsageError;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::filesystem::path folder = tests::test_data("config");

template <typename Function>
std::string usage_error(Function function) {
  try {
    function();
  } catch (const UsageError& error) {
    return error.what();
  }
  return "no error";
}

TEST(GatewaySettings, NameThePlaceAndTheExpectationOfEachMistake) {
  tests::expect_mistakes("gateway", [](const auto& file) {
    return usage_error([&] { settings::read_settings(file); });
  });
}

TEST(GatewaySettings, AreReadFromEachGoodFile) {
  for (const char* name :
       {"nothing", "one_machine", "everything", "policies", "data", "variables", "queues"}) {
    EXPECT_EQ(
        usage_error([&] {
          settings::read_settings(folder / "good" / (name + std::string(".gateway.textproto")));
        }),
        "no error")
        << name;
  }
}

TEST(GatewaySettings, HaveTheSampledVariablesOfAMachine) {
  const settings::Settings sut = settings::read_settings(folder / "good/data.gateway.textproto");
  const data::DataSettings& press = sut.machines.at(0).data;
  EXPECT_EQ(press.requests_per_second, 100);
  ASSERT_EQ(press.groups.size(), 3U);
  const data::GroupSettings expected{.name = "axes",
                                     .channel = 1,
                                     .names = {"V.A.ACT_POS.X", "V.A.ACT_POS.Y"},
                                     .period = std::chrono::milliseconds(100),
                                     .deadband = 0.01};
  EXPECT_EQ(press.groups[0], expected);
  EXPECT_TRUE(press.groups[1].always);
  EXPECT_EQ(press.groups[2].channel, 1);
  EXPECT_EQ(press.groups[2].period, std::chrono::milliseconds(1000));
  ASSERT_EQ(sut.machines.at(0).programs.size(), 2U);
  EXPECT_EQ(sut.machines.at(0).programs[0].counter, "V.E.PARTS");
  EXPECT_EQ(sut.machines.at(0).programs[1].channel, 2);
}

TEST(GatewaySettings, HaveTheMessageQueuesThatAreRead) {
  const settings::Settings sut = settings::read_settings(folder / "good/queues.gateway.textproto");
  const auto& press = sut.machines.at(0).queues;
  ASSERT_EQ(press.size(), 3U);
  EXPECT_EQ(press[0].array, "SD.ALARMS");
  EXPECT_EQ(press[0].key("press").to_string(), "press.ALARMS/1");
  EXPECT_EQ(press[0].acknowledge, queues::Acknowledge::when_journalled);
  EXPECT_EQ(press[1].array, "SD.LINE.PARTS");
  EXPECT_EQ(press[1].acknowledge, queues::Acknowledge::when_answered);
  EXPECT_EQ(press[1].period, std::chrono::milliseconds(100));
  EXPECT_EQ(press[1].backlog, 50U);
  EXPECT_TRUE(press[1].events);
  EXPECT_EQ(press[2].key("press").to_string(), "press.ALARMS/2");
}

TEST(GatewaySettings, HaveTheWritableVariables) {
  const settings::Settings sut =
      settings::read_settings(folder / "good/variables.gateway.textproto");
  const variables::VariableSettings& press = sut.machines.at(0).variables;
  EXPECT_EQ(press.requests_per_second, 200);
  EXPECT_THAT(press.writable,
              ElementsAre(variables::WriteRule{"V.E.*"}, variables::WriteRule{"V.P.OFFSET", {2, 3}},
                          variables::WriteRule{"P10", {2, 3}}));
  EXPECT_EQ(press.cycle, std::chrono::milliseconds(4));
  EXPECT_THAT(sut.machines.at(1).variables.writable, IsEmpty());
  EXPECT_EQ(sut.machines.at(1).variables.requests_per_second, 100);
}

TEST(GatewaySettings, HaveEveryFieldOfAFile) {
  const settings::Settings sut =
      settings::read_settings(folder / "good/everything.gateway.textproto");
  EXPECT_EQ(sut.journal.folder, "/var/lib/millrace");
  EXPECT_EQ(sut.journal.sync, journal::Sync::always);
  ASSERT_EQ(sut.machines.size(), 2U);
  const settings::MachineSettings& press = sut.machines.front();
  EXPECT_EQ(press.to_string(), "press_1 (press1.hall3:48899, 10.0.0.5.1.1)");
  EXPECT_EQ(press.controller.source.to_string(), "10.0.0.9.1.1");
  EXPECT_THAT(press.channels, ElementsAre(1, 2));
  EXPECT_EQ(press.intervals.active, std::chrono::milliseconds(1));
  EXPECT_EQ(press.intervals.idle, std::chrono::milliseconds(20));
  EXPECT_TRUE(press.intervals.kernel_clears_request_state);
  EXPECT_EQ(press.watch, SubscriptionMode::notify);
  EXPECT_EQ(press.symbol, "Channel{channel}.{variable}");
  EXPECT_THAT(sut.machines.back().channels, IsEmpty());
  EXPECT_EQ(sut.machines.back().intervals, ReadIntervals{});
  EXPECT_EQ(sut.machines.back().watch, SubscriptionMode::automatic);
}

TEST(GatewaySettings, HoldThePolicyOfEachMachineAndService) {
  const Policies sut = settings::read_settings(folder / "good/policies.gateway.textproto").policies;
  const auto press = sut.of("press", "other");
  EXPECT_EQ(press.unserved, (Rule{std::chrono::seconds(5), 901}));
  EXPECT_EQ(press.deadline, (Rule{std::chrono::seconds(5), 902}));
  EXPECT_EQ(press.lost, (Rule{std::chrono::seconds(0), 903}));
  EXPECT_EQ(press.refused, (Rule{std::chrono::seconds(0), 904}));
  const auto square_root = sut.of("press", "560aacbf-6335-44a9-895a-8b27f3ed5e47");
  EXPECT_EQ(square_root.deadline, (Rule{std::chrono::minutes(2), 0}));
  EXPECT_EQ(square_root.refused, Rule{}) << "held for an operator";
}

TEST(GatewaySettings, AreThoseOfTheVirtualCncByDefault) {
  EXPECT_EQ(settings::MachineSettings{}.to_string(), "cnc (127.0.0.1:48898, 127.0.0.1.1.1)");
}

TEST(MachineFlag, NamesAMachineWithoutAFile) {
  const settings::MachineSettings sut = settings::parse_machine("press=10.0.0.5:48899/5.1.2.3.4.5");
  EXPECT_EQ(sut.to_string(), "press (10.0.0.5:48899, 5.1.2.3.4.5)");
}

TEST(MachineFlag, UsesTheUsualPortAndNetIdByDefault) {
  EXPECT_EQ(settings::parse_machine("press=10.0.0.5").to_string(),
            "press (10.0.0.5:48898, 10.0.0.5.1.1)");
}

TEST(MachineFlag, ReadsThePortAfterTheLastColon) {
  EXPECT_EQ(settings::parse_machine("press=fe80::7:48899/5.1.2.3.4.5").to_string(),
            "press (fe80::7:48899, 5.1.2.3.4.5)");
}

TEST(MachineFlag, ReportsWhatItExpects) {
  for (const auto& [text, expected] : {
           std::pair("press", "expected NAME=HOST:PORT/NETID"),
           std::pair("=10.0.0.5", "a machine has no name"),
           std::pair("a b=10.0.0.5", "expected letters, digits"),
           std::pair("press=:1/1.1.1.1.1.1", "the host is missing"),
           std::pair("press=10.0.0.5:http", "port \"http\"; expected 1 to 65535"),
           std::pair("press=10.0.0.5/1.2", "NetId \"1.2\"; expected six numbers"),
           std::pair("press=press1.hall3", "NetId \"press1.hall3.1.1\"; expected six numbers"),
       }) {
    EXPECT_THAT(usage_error([&text = text] { settings::parse_machine(text); }), HasSubstr(expected))
        << text;
  }
}

TEST(MachineFlag, MayNotUseANameTwice) {
  EXPECT_THAT(usage_error([] {
                settings::check_names({settings::MachineSettings{}, settings::MachineSettings{}});
              }),
              HasSubstr("two machines are called \"cnc\""));
}

TEST(TheJournalOfAGateway, IsInTheFolderOfItsUnitOrOfItsUser) {
  using settings::default_journal_folder;
  const settings::StateFolders user{.xdg_state_home = "/state", .home = "/home/me"};
  EXPECT_EQ(default_journal_folder(user, "millrace", 7), "/state/millrace/gateway-7");
  EXPECT_EQ(default_journal_folder({.home = "/home/me"}, "millrace", 0),
            "/home/me/.local/state/millrace/gateway-0");
  EXPECT_EQ(
      default_journal_folder({.xdg_state_home = "not/absolute", .home = "/root"}, "millrace", 0),
      "/root/.local/state/millrace/gateway-0");
  EXPECT_EQ(
      default_journal_folder({"/var/lib/gateway:/var/lib/more", "/state", "/root"}, "hall/1", 0),
      "/var/lib/gateway");
  EXPECT_EQ(default_journal_folder(user, "hall/1", 7), "/state/millrace/gateway-7-hall_1");
  EXPECT_THROW(default_journal_folder({}, "millrace", 0), UsageError);
}

}  // namespace
}  // namespace millrace::gateway
