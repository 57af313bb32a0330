// A service as a process: its ready line, its end by a signal and by a crash.
#include <chrono>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/program/command_line.hpp"
#include "tests/support/caller.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace {
namespace {

using testing::HasSubstr;
using testing::Not;
using tests::Process;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

class ServiceProcess : public testing::Test {
 protected:
  Process start(std::vector<std::string> arguments = {}) {
    std::vector<std::string> command{tests::binary("millrace-square-root"), "--domain",
                                     std::to_string(domain.number())};
    command.insert(command.end(), arguments.begin(), arguments.end());
    return Process(std::move(command));
  }

  tests::Domain domain;
  tests::Caller caller{domain.number()};
};

TEST_F(ServiceProcess, ReportsOnceThatItIsReadyAndAnswers) {
  Process sut = start({"--log-level", "debug"});
  const std::string instance =
      sut.await("^ready: square_root serves " + uuid + " as (\\S+) on domain \\d+$").at(1);
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.identity(uuid).id.to_string(), instance);
  EXPECT_EQ(caller.call(uuid, "2").text, "1.414214");
  EXPECT_EQ(caller.call(uuid, "-4").state, 99U);
  const std::string call =
      sut.await_error("call (\\S+) from \\S+: \"2\", state \\d+, attempt 1").at(1);
  sut.await_error("call " + call + " answered: \"1.414214\", state 1, after ");
}

TEST_F(ServiceProcess, LogsOneLineForManyCallsByDefault) {
  Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  for (int number = 0; number < 20; ++number) {
    ASSERT_EQ(caller.call(uuid, "4").text, "2.000000");
  }
  sut.terminate();
  EXPECT_EQ(sut.wait(), 0);
  EXPECT_THAT(sut.error_output(), HasSubstr(uuid + ": 20 calls answered in "));
  EXPECT_THAT(sut.error_output(), Not(HasSubstr("info  call ")));
}

TEST_F(ServiceProcess, AnnouncesTheOptionsOfItsCommandLine) {
  Process sut = start({"--uuid", "Weather", "--name", "weather", "--channel", "cnc/1", "--channel",
                       "press/*", "--concurrency", "4", "--delivery", "at-most-once",
                       "--completion-signal", "response"});
  ASSERT_TRUE(caller.await_instance("Weather"));
  const fabric::InstanceIdentity instance = caller.identity("Weather");
  EXPECT_EQ(instance.name, "weather");
  EXPECT_EQ(instance.channels.size(), 2U);
  EXPECT_EQ(instance.concurrency, 4U);
  EXPECT_EQ(instance.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(instance.completion_signal, fabric::CompletionSignal::response);
  EXPECT_EQ(instance.pid, static_cast<std::uint32_t>(sut.pid()));
}

TEST_F(ServiceProcess, IsMissedByItsHeartbeatsWhenItIsKilled) {
  Process sut = start();
  ASSERT_TRUE(caller.await_instance(uuid));
  const auto killed = std::chrono::steady_clock::now();
  sut.kill();
  ASSERT_TRUE(caller.await_no_instance(uuid));
  // The missing heartbeat shows it, not Cyclone's lease of a participant, 10 s. On a busy host an
  // observer that was not run itself waits longer than four fifths of the lease: a standstill is no
  // silence. InstanceRegistryTest has the exact times.
  EXPECT_LT(std::chrono::steady_clock::now() - killed, std::chrono::seconds(9));
}

/// The typical environment of a host with ROS 2.
const std::string environment =
    R"(CYCLONEDDS_URI=<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces></General>)";

TEST_F(ServiceProcess, IgnoresCyclonesVariableIfItHasAProfileAndLogsThatOnce) {
  const tests::TemporaryFolder folder;
  const std::string profile = folder.path() / "fabric.textproto";
  std::ofstream(profile) << "interface: \"lo\"\n";
  Process sut({"/usr/bin/env", environment, tests::binary("millrace-square-root"), "--domain",
               std::to_string(domain.number()), "--fabric-config", profile});
  ASSERT_TRUE(caller.await_instance(uuid));
  EXPECT_EQ(caller.call(uuid, "2").text, "1.414214");
  sut.terminate();
  EXPECT_EQ(sut.wait(), base::program::exit_done);
  const std::string text = sut.error_output();
  const auto first = text.find("CYCLONEDDS_URI is ignored");
  EXPECT_NE(first, std::string::npos) << text;
  EXPECT_EQ(text.find("CYCLONEDDS_URI", first + 1), std::string::npos) << text;
}

TEST_F(ServiceProcess, UsesCyclonesVariableIfItHasNoProfile) {
  Process sut({"/usr/bin/env", "MILLRACE_FABRIC_CONFIG=", "CYCLONEDDS_URI=<NoSuchElement/>",
               tests::binary("millrace-square-root"), "--domain", std::to_string(domain.number())});
  EXPECT_EQ(sut.wait(), base::program::exit_failed);
  EXPECT_THAT(sut.error_output(), HasSubstr("NoSuchElement"));
}

}  // namespace
}  // namespace millrace
