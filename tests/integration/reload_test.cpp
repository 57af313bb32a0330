// SIGHUP: the gateway reads its configuration again while calls are under way.
#include <csignal>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* channel_1 =
    "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
    "channel: 1 }\n";
constexpr const char* both_channels =
    "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
    "channel: [1, 2] }\n";

TEST(AReload, AddsAChannelWithoutTouchingTheCallUnderWay) {
  Chain sut;
  Process service = sut.slow_service({"--work", "1500", "--log-level", "debug"});
  Process other = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--run",
                         Chain::program(2, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.configured_gateway(channel_1, {"--log-level", "debug"});
  gateway.await_error("cnc/1: call .* given to");
  sut.configure(both_channels);
  gateway.signal(SIGHUP);
  gateway.await_error("read again");
  cnc.await("\\[ch2\\] response = 1.732051");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] answer = first, state = 1"));
  EXPECT_THAT(gateway.error_output(), Not(HasSubstr("attempt 2")));
}

TEST(AReload, FinishesTheCallOfARemovedChannel) {
  Chain sut;
  Process service = sut.slow_service({"--work", "1000"});
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"});
  Process gateway = sut.configured_gateway(both_channels, {"--log-level", "debug"});
  gateway.await_error("cnc/1: call .* given to");
  sut.configure(
      "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" "
      "channel: 2 }\n");
  gateway.signal(SIGHUP);
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] answer = first, state = 1"));
}

TEST(AReload, ReleasesAMachineOnceItsCallIsAnswered) {
  Chain sut;
  Process service = sut.slow_service({"--work", "1000"});
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc")});
  Process gateway = sut.configured_gateway(both_channels, {"--log-level", "debug"});
  gateway.await_error("cnc/1: call .* given to");
  sut.configure(
      "machine { name: \"press\" host: \"127.0.0.1\" port: 1 net_id: \"1.2.3.4.5.6\" }\n");
  gateway.signal(SIGHUP);
  gateway.await_error("removed from the configuration");
  cnc.await("answer = first, state = 1");
  Process machines = sut.millrace({"machines"});
  EXPECT_EQ(machines.wait(), 0);
  EXPECT_THAT(machines.output(), Not(HasSubstr("127.0.0.1.1.1")));
  EXPECT_THAT(machines.output(), HasSubstr("press"));
}

TEST(AReload, AppliesANewPolicyToARequestThatWaits) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "one_slow_call.nc"), "--exit-when-idle"});
  Process gateway = sut.configured_gateway(channel_1);
  gateway.await_error("no service has the UUID");
  sut.configure(std::string(channel_1) +
                "policy { unserved { after_ms: 10 response_state: 901 } }\n");
  gateway.signal(SIGHUP);
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("state = 901"));
}

TEST(AReload, RefusesABadFileWithThePlaceOfTheMistakeAndKeepsTheOldOne) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.configured_gateway(channel_1);
  gateway.await_error("no service has the UUID");
  sut.configure(std::string(channel_1) + "policy {\n  deadline { response_state: 902 }\n}\n");
  gateway.signal(SIGHUP);
  gateway.await_error(
      "the configuration stays as it was: .*gateway\\.textproto:3:3: policy.deadline: it has no "
      "after_ms");
  Process service = sut.square_root();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
}

TEST(AReload, ReportsThatThereIsNoFileToReload) {
  Chain sut;
  Process cnc = sut.cnc();
  Process gateway = sut.gateway();
  gateway.signal(SIGHUP);
  gateway.await_error("SIGHUP: no configuration file to reload");
  gateway.terminate();
  EXPECT_EQ(gateway.wait(), 0);
}

}  // namespace
}  // namespace millrace::tests::integration
