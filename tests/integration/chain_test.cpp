// One call from end to end, with the real programs: NC program → ADS → gateway → DDS → service and
// back.
#include "tests/integration/chain.hpp"

#include <csignal>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(TheChain, AnswersTheSquareRootCallOfAnNcProgram) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] response = 1.732051\n"));
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] state = 1, request state = 0\n"));
}

TEST(TheChain, PassesTheServicesErrorToTheProgram) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(2, "negative_number.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch2] 99: ERROR: cannot calc square root of negative number "
                                      "-2.000000\n"));
}

// The manual says that the program waits for RESPONSE (IB/tf5200_service_interface/356533387,
// documented). It sends its next request as soon as it has the text, and no late write of the
// previous answer wipes that.
TEST(TheChain, AnswersAProgramThatWaitsForTheTextAloneWithState0) {
  Chain sut;
  Process service =
      sut.slow_service({"--completion-signal", "response", "--state", "0", "--interim", "50"});
  Process cnc = sut.cnc({"--run", Chain::program(1, "waits_for_the_text.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] 100 calls answered, state 0\n"));
}

TEST(TheChain, AnswersACallThatWasMadeBeforeItsServiceExisted) {
  Chain sut;
  Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  gateway.await_error("no service has the UUID");
  EXPECT_THAT(cnc.output(), Not(HasSubstr("response")));
  Process service = sut.square_root();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] response = 1.732051\n"));
}

TEST(TheChain, NeverLosesTheReplyOfAServiceStartedAMomentBeforeTheCall) {
  Chain sut;
  for (int round = 0; round < 10; ++round) {
    Process cnc = sut.cnc({"--run", Chain::program(1, "square_root_of_3.nc"), "--exit-when-idle"});
    Process gateway = sut.gateway();
    Process service = sut.square_root();
    ASSERT_EQ(cnc.wait(), 0) << "round " << round << ": " << cnc.error_output();
  }
}

TEST(TheChain, ServesTwoChannelsWithTwoServicesAtOnce) {
  Chain sut;
  Process first =
      sut.square_root({"--channel", "cnc/1", "--name", "first", "--log-level", "debug"});
  Process second =
      sut.square_root({"--channel", "cnc/2", "--name", "second", "--log-level", "debug"});
  Process cnc = sut.cnc({"--run", Chain::program(1, "many_calls.nc"), "--run",
                         Chain::program(2, "many_calls.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] 200 calls, last 1.414214\n"));
  EXPECT_THAT(cnc.output(), HasSubstr("[ch2] 200 calls, last 1.414214\n"));
  EXPECT_THAT(first.error_output(), Not(HasSubstr("cnc/2:")));
  EXPECT_THAT(second.error_output(), Not(HasSubstr("cnc/1:")));
}

TEST(TheChain, LeavesARequestOfAnUnservedUuidUnansweredAndNamesTheNearestOne) {
  Chain sut;
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "near_miss.nc")});
  Process gateway = sut.gateway();
  gateway.await_error(
      "; did you mean 560aacbf-6335-44a9-895a-8b27f3ed5e47, one character is "
      "missing");
}

TEST(TheChain, DispatchesTheCallToAnotherInstanceWhenTheFirstIsFrozen) {
  Chain sut;
  // The instance that names the channel gets every call; while frozen, it can only lose one.
  Process named = sut.square_root({"--channel", "cnc/1"});
  Process other = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway({"--log-level", "debug"});
  // The other instance may be found first and answer a few calls before.
  gateway.await_error(fmt::format("given to square_root \\(pid {} ", named.pid()));
  named.signal(SIGSTOP);
  gateway.await_error("attempt 2");
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] 200 calls, last 1.414214\n"));
  named.signal(SIGCONT);
}

TEST(TheChain, ContinuesAfterEachGatewayThatWasKilledInTheMiddle) {
  Chain sut;
  const std::string journal = (sut.folder() / "journal").string();
  Process service = sut.square_root();
  Process cnc = sut.cnc({"--run", Chain::program(1, "many_calls.nc"), "--exit-when-idle"});
  for (int round = 0; round < 5; ++round) {
    Process gateway = sut.gateway({"--journal", journal, "--log-level", "debug"});
    gateway.await_error("answered");
    gateway.kill();
  }
  Process gateway = sut.gateway({"--journal", journal});
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_EQ(cnc.output().find("failed"), std::string::npos) << cnc.output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch1] 200 calls, last 1.414214\n"));
}

TEST(AService, FinishesAndLeavesOnSigterm) {
  Chain sut;
  Process service = sut.square_root();
  Process idle_cnc = sut.cnc();
  Process gateway = sut.gateway();
  gateway.await_error("instance .* ready");
  service.terminate();
  EXPECT_EQ(service.wait(), 0) << service.error_output();
  gateway.await_error("instance .* gone");
}

struct WrongUse {
  std::string name;
  std::string program;
  Flags flags;
  std::string message;
};

void PrintTo(const WrongUse& use, std::ostream* out) {
  *out << use.name;
}

class EachProgram : public testing::TestWithParam<WrongUse> {};

TEST_P(EachProgram, RefusesAWrongCommandLineWithExitCodeTwoAndAHelpfulMessage) {
  Flags command{binary(GetParam().program)};
  command.insert(command.end(), GetParam().flags.begin(), GetParam().flags.end());
  Process sut(std::move(command));
  EXPECT_EQ(sut.wait(), 2);
  EXPECT_THAT(sut.error_output(), HasSubstr(GetParam().program + ": "));
  EXPECT_THAT(sut.error_output(), HasSubstr(GetParam().message));
  EXPECT_EQ(sut.output(), "");
}

INSTANTIATE_TEST_SUITE_P(
    Usage, EachProgram,
    testing::Values(
        WrongUse{"UnknownFlag", "millrace-cnc", {"--chanels", "2"}, "--chanels"},
        WrongUse{"NoNumber", "millrace-cnc", {"--channels", "zero"}, "zero"},
        WrongUse{
            "MissingProgram", "millrace-cnc", {"--run", "1=no_such_file.nc"}, "no_such_file.nc"},
        WrongUse{"NoAddress", "millrace-cnc", {"--listen", "nonsense"}, "nonsense"},
        WrongUse{
            "MissingConfig", "millrace-gateway", {"--config", "none.textproto"}, "none.textproto"},
        WrongUse{"NoMachine", "millrace-gateway", {"--machine", "cnc"}, "NAME=HOST:PORT/NETID"},
        WrongUse{"NoDomain", "millrace-gateway", {"--domain", "300"}, "300"},
        WrongUse{"NoThread", "millrace-square-root", {"--concurrency", "0"}, "concurrency"},
        WrongUse{"NoChannel", "millrace-square-root", {"--channel", "cnc/0"}, "MACHINE/N"},
        WrongUse{"Pattern", "millrace-square-root", {"--uuid", "a*"}, "wildcard"}),
    [](const testing::TestParamInfo<WrongUse>& use) { return use.param.name; });

}  // namespace
}  // namespace millrace::tests::integration
