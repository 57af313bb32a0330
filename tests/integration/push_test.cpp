// A gateway with notifications from controllers of every kind, and with controllers that do not
// send them.
#include <csignal>
#include <fstream>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/integration/chain.hpp"
#include "tests/support/await.hpp"

namespace millrace::tests::integration {
namespace {

using testing::HasSubstr;

class Notifications : public testing::Test {
 protected:
  /// A virtual CNC with these properties of its connections.
  Process cnc(const std::string& connections, Flags flags = {}) {
    const auto file = sut.folder() / "cnc.textproto";
    std::ofstream(file) << connections << "\n";
    flags.insert(flags.end(), {"--config", file.string()});
    return sut.cnc(flags);
  }
  static std::string machine(const std::string& more) {
    return "machine { name: \"cnc\" host: \"127.0.0.1\" port: @PORT@ net_id: \"127.0.0.1.1.1\" " +
           more + " }\n";
  }
  /// Waits until `millrace machines` prints this.
  void await_of_the_machine(const std::string& pattern) {
    std::string output;
    try {
      await(pattern, [&] {
        Process machines = sut.millrace({"machines", "--json"});
        machines.wait();
        output = machines.output();
        return std::regex_search(output, std::regex(pattern));
      });
    } catch (const std::exception& error) {
      FAIL() << error.what() << "; it says " << output;
    }
  }

  Chain sut;
};

// Only safety reads, of all channels in one request.
TEST_F(Notifications, CostAnIdleMachineOfTenChannelsFiveRequestsASecondAtMost) {
  Process cnc = this->cnc("", {"--channels", "10"});
  Process gateway = sut.gateway();
  gateway.await_error("pushed: ");
  await_of_the_machine("\"requests_per_second\":[1-5],");
}

TEST_F(Notifications, LeaveNothingBehindWhenTheGatewayEnds) {
  // Like a TwinCAT router, which keeps them; with room for the notifications of one gateway.
  Process cnc = this->cnc("connections { notifications_survive: true notifications { most: 4 } }");
  for (int times = 0; times < 3; ++times) {
    Process gateway = sut.gateway();
    gateway.await_error("pushed: ");
    // While a request is under way there is no room for a farewell.
    await_of_the_machine("\"watch\":\"pushed\"");
    gateway.terminate();
    EXPECT_EQ(gateway.wait(), 0) << gateway.error_output();
  }
}

TEST_F(Notifications, FollowANewConfiguration) {
  Process cnc = this->cnc("connections { notifications { most: 4 } }");
  Process gateway = sut.configured_gateway(machine(""));
  gateway.await_error("pushed: ");
  for (int times = 0; times < 2; ++times) {
    sut.configure(machine("watch: POLL"));
    gateway.signal(SIGHUP);
    await_of_the_machine("\"reason\":\"polled, as configured\"");
    sut.configure(machine("watch: AUTO"));
    gateway.signal(SIGHUP);
    await_of_the_machine("\"watch\":\"pushed\"");
  }
  sut.configure(machine("channel: 2"));
  gateway.signal(SIGHUP);
  await_of_the_machine("\"channels\":1[,}]");
  await_of_the_machine("\"watch\":\"pushed\"");
}

TEST_F(Notifications, ThatAreRequiredButRefusedCauseAWarning) {
  Process cnc = this->cnc("connections { notifications { by_handle: NO_MORE_HANDLES } }");
  Process gateway = sut.configured_gateway(machine("watch: NOTIFY"));
  gateway.await_error("gateway warning .*polled: .*0x716");
}

TEST_F(Notifications, FindTheSymbolsByTheConfiguredName) {
  Process cnc = this->cnc("");
  Process gateway = sut.configured_gateway(machine("symbol: \"Channel{channel}.{variable}\""));
  gateway.await_error(
      "polled: the controller gives no handle for "
      "Channel1.V.G.SERVICE.REQUEST_STATE: 0x710");
}

TEST_F(Notifications, ProbeTheIndexGroupsOfOlderControllers) {
  Process service = sut.square_root();
  Process cnc = this->cnc("answers { current_groups: false }",
                          {"--run", Chain::program(2, "square_root_of_3.nc"), "--exit-when-idle"});
  Process gateway = sut.gateway();
  EXPECT_EQ(cnc.wait(), 0) << cnc.error_output();
  EXPECT_THAT(cnc.output(), HasSubstr("[ch2] response = 1.732051\n"));
}

/// Calls of one channel with pauses, in which the controller can show whether it notifies.
class NotificationsOfAProgramThatPauses : public Notifications {
 protected:
  Process cnc_that(const std::string& faults) {
    const auto program = sut.folder() / "pauses.nc";
    std::ofstream(program)
        << "%pauses\nN10 V.G.SERVICE.UUID = \"560aacbf-6335-44a9-895a-8b27f3ed5e47\"\n"
           "N20 P1 = 1\nN30 $WHILE P1 <= 20\nN40 V.G.SERVICE.REQUEST = \"2\"\n"
           "N50 V.G.SERVICE.REQUEST_STATE = P1\nN60 #FLUSH CONTINUE\n"
           "N70 #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0\nN80 #TIME 0.05\n"
           "N90 #FLUSH WAIT\nN100 P1 = P1 + 1\nN110 $ENDWHILE\n"
           "N120 #MSG [\"%d calls\", P1 - 1]\nN130 M30\n";
    return cnc("faults { " + faults + " }", {"--run", "1=" + program.string()});
  }
};

TEST_F(NotificationsOfAProgramThatPauses, AreGivenUpWhereTheyComeLate) {
  Process service = sut.square_root();
  Process cnc = cnc_that("sample_delay_ms: 300");
  Process gateway = sut.gateway();
  gateway.await_error("pushed: ");
  cnc.await("\\[ch1\\] 20 calls");
  gateway.await_error("polled: its? ");
}

TEST_F(NotificationsOfAProgramThatPauses, AreGivenUpWhereSomeAreLost) {
  Process service = sut.square_root();
  Process cnc = cnc_that("lose_sample_every: 3");
  Process gateway = sut.gateway();
  gateway.await_error(
      "polled: it (sent no notification of|does not send a notification for each|accepts "
      "subscriptions and sends)");
  cnc.await("\\[ch1\\] 20 calls");
}

/// A property of the virtual CNC, and the gateway's reaction.
struct Kind {
  const char* name;
  const char* connections;
  /// In the gateway's log.
  const char* word;
};

class ControllersOf : public Notifications, public testing::WithParamInterface<Kind> {};

TEST_P(ControllersOf, AreServed) {
  Process service = sut.square_root();
  Process cnc = this->cnc(
      std::string("connections { ") + GetParam().connections + " }",
      {"--run", Chain::program(1, "many_calls.nc"), "--run", Chain::program(2, "many_calls.nc")});
  Process gateway = sut.gateway();
  cnc.await("\\[ch1\\] 200 calls, last 1.414214");
  cnc.await("\\[ch2\\] 200 calls, last 1.414214");
  EXPECT_NO_THROW(gateway.await_error(GetParam().word)) << gateway.error_output();
}

INSTANTIATE_TEST_SUITE_P(
    EveryKind, ControllersOf,
    testing::Values(
        Kind{"that_tell", "", "pushed: "}, Kind{"without_sums", "sum_commands: false", "pushed: "},
        Kind{"whose_variables_are_no_symbols", "variable_symbols: false",
             "polled: the controller gives no handle .*0x710"},
        Kind{"without_symbols", "symbols: false", "polled: the controller gives no handle .*0x702"},
        Kind{"without_symbols_and_sums", "symbols: false sum_commands: false",
             "polled: the controller gives no handle .*0x702"},
        Kind{"that_refuse_the_service", "notifications { by_handle: SERVICE_NOT_SUPPORTED }",
             "polled: the controller sends no notifications .*0x701"},
        Kind{"that_refuse_the_group", "notifications { by_handle: INVALID_GROUP }",
             "polled: the controller sends no notifications .*0x702"},
        Kind{"that_refuse_the_offset", "notifications { by_handle: INVALID_OFFSET }",
             "polled: the controller sends no notifications .*0x703"},
        Kind{"that_deny_access", "notifications { by_handle: ACCESS_DENIED }",
             "polled: the controller sends no notifications .*0x704"},
        Kind{"that_refuse_the_size", "notifications { by_handle: INVALID_SIZE }",
             "polled: the controller sends no notifications .*0x705"},
        Kind{"with_no_more_handles", "notifications { by_handle: NO_MORE_HANDLES }",
             "polled: the controller sends no notifications .*0x716"},
        Kind{"with_room_for_one_channel", "notifications { most: 2 }",
             "pushed, except in channel 2: .*0x716"},
        Kind{"that_tell_nothing", "notifications { tells: NOTHING }",
             "polled: it accepts subscriptions and sends no notification"},
        Kind{"that_tell_the_first_value", "notifications { tells: FIRST_VALUE }",
             "polled: it (d|s|a)"},
        Kind{"that_refuse_sums_handles_and_notifications_of_old_groups",
             "symbols: false variable_symbols: false sum_commands: false "
             "notifications { by_handle: SERVICE_NOT_SUPPORTED } } answers { current_groups: false",
             "polled: the controller gives no handle .*0x702"},
        // The effect depends on which ones are lost; see the test above.
        Kind{"that_lose_every_third", "} faults { lose_sample_every: 3", "pushed: "}),
    [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace millrace::tests::integration
