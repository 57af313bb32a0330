// The program millrace-gateway from a user's view: flags, ready line, exit codes, Secure ADS.
#include <csignal>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::tests {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::string config(const std::string& name) {
  return test_data("config/" + name + ".gateway.textproto");
}

class MillraceGateway : public testing::Test {
 protected:
  Process gateway(std::vector<std::string> flags) {
    std::vector<std::string> command{binary("millrace-gateway"), "--domain",
                                     std::to_string(domain_.number())};
    command.insert(command.end(), flags.begin(), flags.end());
    return Process(std::move(command));
  }

  Process square_root() {
    Process service({binary("millrace-square-root"), "--domain", std::to_string(domain_.number())});
    service.await("^ready: ");
    return service;
  }

  Domain domain_;
  TemporaryFolder folder_;
};

TEST_F(MillraceGateway, IsReadyWithoutAControllerAndEndsCleanlyOnSigterm) {
  Process sut = gateway({"--machine", "press=127.0.0.1:1/10.0.0.5.1.1"});
  sut.await("^ready: gateway of press \\(127\\.0\\.0\\.1:1, 10\\.0\\.0\\.5\\.1\\.1\\) on domain " +
            std::to_string(domain_.number()) + "$");
  sut.await_error("press .*refused.*trying again");
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(sut.error_output(), ContainsRegex("the journal is in /[^\n]*/millrace/gateway-" +
                                                std::to_string(domain_.number())));
}

TEST_F(MillraceGateway, SaysEverywhereThatItHasNoJournal) {
  Process sut = gateway({"--no-journal", "--machine", "press=127.0.0.1:1/10.0.0.5.1.1"});
  sut.await("^ready: .*, without a journal$");
  EXPECT_THAT(sut.error_output(), ContainsRegex("warning[^\n]*no journal: when this gateway ends"));
  for (const char* command : {"status", "doctor"}) {
    Process shown({binary("millrace"), command, "--domain", std::to_string(domain_.number())});
    shown.wait();
    EXPECT_THAT(shown.output(), HasSubstr("no journal: when this gateway ends")) << command;
  }
  Process machines(
      {binary("millrace"), "machines", "--json", "--domain", std::to_string(domain_.number())});
  machines.wait();
  EXPECT_THAT(machines.output(), HasSubstr("\"journal\":\"none\""));
}

TEST_F(MillraceGateway, RefusesADefaultJournalThatAnotherGatewayUses) {
  const std::vector<std::string> command{binary("millrace-gateway"), "--domain",
                                         std::to_string(domain_.number())};
  Process first(command, folder_.path());
  first.await("^ready: ");
  Process sut(command, folder_.path());
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(
      sut.error_output(),
      ContainsRegex("gateway-[0-9]+: another gateway uses this journal folder; .*--journal"));
}

TEST_F(MillraceGateway, TakesAJournalOrNone) {
  Process sut = gateway({"--no-journal", "--journal", folder_.path()});
  EXPECT_EQ(sut.wait(), 2);
  EXPECT_THAT(sut.error_output(), HasSubstr("excludes"));
}

TEST_F(MillraceGateway, ChecksAConfigurationAndEnds) {
  Process good = gateway({"--check", "--config", config("good/everything")});
  EXPECT_EQ(good.wait(), 0) << good.error_output();
  EXPECT_THAT(good.output(), HasSubstr("press_1 (press1.hall3:48899, 10.0.0.5.1.1)"));
  write_bad_configurations("gateway", folder_.path());
  Process bad = gateway({"--check", "--config", folder_.path() / "bad_net_id.gateway.textproto"});
  EXPECT_EQ(bad.wait(), 2);
  EXPECT_THAT(bad.error_output(), HasSubstr("bad_net_id.gateway.textproto:4:3: machine.net_id"));
}

TEST_F(MillraceGateway, PassesACallOverSecureAdsOnceItsPasswordIsRight) {
  const auto write = [this](const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
    std::filesystem::permissions(folder_.path() / name, std::filesystem::perms(0640));
    return (folder_.path() / name).string();
  };
  Process service = square_root();
  Process controller({binary("millrace-cnc"), "--config",
                      write("cnc.textproto",
                            "secure_ads { listen: \"127.0.0.1:0\" only: true "
                            "psk { identity: \"millrace\" password: \"secret\" } }"),
                      "--dir", folder_.path().string(), "--speed", "0", "--exit-when-idle", "--run",
                      "1=" + test_data("nc/square_root.nc").string()});
  const std::string port =
      controller.await("^ready: .*, Secure ADS at 127\\.0\\.0\\.1:(\\d+)").at(1);
  write("cnc.psk", "wrong");
  Process sut = gateway(
      {"--config", write("gateway.textproto",
                         "machine { name: \"cnc\" host: \"127.0.0.1\" port: " + port +
                             " net_id: \"127.0.0.1.1.1\" secure { psk { identity: \"millrace\" "
                             "password_file: \"cnc.psk\" } } }")});
  sut.await_error("the pre-shared key of identity \"millrace\" is not the controller's");
  write("cnc.psk", "secret");
  sut.signal(SIGHUP);
  sut.await_error("cnc \\(127\\.0\\.0\\.1:" + port +
                  ", 127\\.0\\.0\\.1\\.1\\.1, Secure ADS\\): link up");
  EXPECT_EQ(controller.wait(), 0) << controller.error_output();
}

TEST_F(MillraceGateway, WarnsOfPlainAdsOverANetwork) {
  // 0.0.0.0 leads only to this host, but the text does not show it.
  Process sut = gateway(
      {"--machine", "saw=127.0.0.1:1/10.0.0.6.1.1", "--machine", "press=0.0.0.0:1/10.0.0.5.1.1"});
  sut.await_error("press \\(0\\.0\\.0\\.0:1, .*\\): plain ADS: any host on its network");
  EXPECT_THAT(sut.error_output(), Not(ContainsRegex("saw [^\n]*: plain ADS")));
}

TEST_F(MillraceGateway, RefusesAJournalThatAnotherGatewayUses) {
  const std::string journal = (folder_.path() / "journal").string();
  Process first = gateway({"--journal", journal});
  first.await("^ready: ");
  Process sut = gateway({"--journal", journal});
  EXPECT_EQ(sut.wait(), 1);
  EXPECT_THAT(sut.error_output(), HasSubstr("another gateway uses this journal folder"));
}

}  // namespace
}  // namespace millrace::tests
