// Every process is killed and frozen at every point of a call; the program still gets its answers.
#include <gtest/gtest.h>

#include "tests/failures/line.hpp"

namespace millrace::tests::failures {
namespace {

enum class Fault { kill, kill_after_the_write, freeze };

struct Case {
  const char* name;
  Victim victim;
  Point point;
  Fault fault;
  bool secure = false;
};

void PrintTo(const Case& tested, std::ostream* out) {
  *out << tested.name;
}

class EveryProcess : public testing::TestWithParam<Case> {};

TEST_P(EveryProcess, MayDieOrFreezeAtAnyPointOfACall) {
  Line sut({.point = GetParam().point, .secure = GetParam().secure});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  if (GetParam().fault == Fault::freeze) {
    ASSERT_NO_FATAL_FAILURE(sut.freeze(GetParam().victim));
  } else {
    sut.kill(GetParam().victim, GetParam().fault == Fault::kill_after_the_write);
  }
  sut.expect_every_answer();
}

using enum Point;
using enum Victim;

INSTANTIATE_TEST_SUITE_P(
    Crash, EveryProcess,
    testing::Values(
        Case{"GatewayBeforeItAccepts", gateway, before_accept, Fault::kill},
        Case{"GatewayAfterItAccepted", gateway, accepted, Fault::kill},
        Case{"GatewayAfterItDispatched", gateway, dispatched, Fault::kill},
        Case{"GatewayWhileTheCallRuns", gateway, running, Fault::kill},
        Case{"GatewayBeforeAnInterimState", gateway, interim, Fault::kill},
        Case{"GatewayAfterAnInterimState", gateway, interim, Fault::kill_after_the_write},
        Case{"GatewayBeforeItWritesTheAnswer", gateway, answered, Fault::kill},
        Case{"GatewayAfterItWroteResponse", gateway, answered, Fault::kill_after_the_write},
        Case{"GatewayBeforeItClearsTheRequest", gateway, before_clear, Fault::kill},
        Case{"GatewayAfterItClearedTheRequest", gateway, before_clear, Fault::kill_after_the_write},
        Case{"GatewayBeforeItReleasesTheProgram", gateway, before_release, Fault::kill},
        Case{"GatewayAfterItReleasedTheProgram", gateway, before_release,
             Fault::kill_after_the_write},
        Case{"ServiceBeforeTheCallIsAccepted", service, before_accept, Fault::kill},
        Case{"ServiceBeforeItGetsTheCall", service, accepted, Fault::kill},
        Case{"ServiceBeforeItBegins", service, dispatched, Fault::kill},
        Case{"ServiceWhileItRuns", service, running, Fault::kill},
        Case{"ServiceAfterItsInterimState", service, interim, Fault::kill},
        Case{"ServiceAfterItAnswered", service, answered, Fault::kill},
        Case{"ServiceWhileItsAnswerIsWritten", service, before_release, Fault::kill},
        Case{"ControllerBeforeTheCallIsAccepted", controller, before_accept, Fault::kill},
        Case{"ControllerAfterTheCallWasAccepted", controller, accepted, Fault::kill},
        Case{"ControllerAfterTheCallWasDispatched", controller, dispatched, Fault::kill},
        Case{"ControllerWhileTheCallRuns", controller, running, Fault::kill},
        Case{"ControllerBeforeAnInterimState", controller, interim, Fault::kill},
        Case{"ControllerBeforeTheAnswer", controller, answered, Fault::kill},
        Case{"ControllerBeforeTheRequestIsCleared", controller, before_clear, Fault::kill},
        Case{"ControllerBeforeTheProgramIsReleased", controller, before_release, Fault::kill}),
    [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Frozen, EveryProcess,
    testing::Values(
        Case{"GatewayBeforeItAccepts", gateway, before_accept, Fault::freeze},
        Case{"GatewayAfterItAccepted", gateway, accepted, Fault::freeze},
        Case{"GatewayWhileTheCallRuns", gateway, running, Fault::freeze},
        Case{"GatewayBeforeAnInterimState", gateway, interim, Fault::freeze},
        Case{"GatewayBeforeItWritesTheAnswer", gateway, answered, Fault::freeze},
        Case{"GatewayBeforeItClearsTheRequest", gateway, before_clear, Fault::freeze},
        Case{"GatewayBeforeItReleasesTheProgram", gateway, before_release, Fault::freeze},
        Case{"ServiceBeforeItGetsTheCall", service, accepted, Fault::freeze},
        Case{"ServiceBeforeItBegins", service, dispatched, Fault::freeze},
        Case{"ServiceWhileItRuns", service, running, Fault::freeze},
        Case{"ServiceAfterItAnswered", service, answered, Fault::freeze},
        Case{"ControllerBeforeTheCallIsAccepted", controller, before_accept, Fault::freeze},
        Case{"ControllerBeforeTheAnswer", controller, answered, Fault::freeze},
        Case{"ControllerBeforeTheRequestIsCleared", controller, before_clear, Fault::freeze},
        Case{"ControllerBeforeTheProgramIsReleased", controller, before_release, Fault::freeze}),
    [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Secure, EveryProcess,
    testing::Values(Case{"SecureGatewayKilled", gateway, running, Fault::kill, true},
                    Case{"SecureGatewayFrozen", gateway, running, Fault::freeze, true},
                    Case{"SecureControllerKilled", controller, running, Fault::kill, true},
                    Case{"SecureControllerFrozen", controller, running, Fault::freeze, true}),
    [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

/// With trust, a restart needs one more handshake, and the new process must prove its identity
/// before it replaces the dead one.
class EveryTrustedProcess : public testing::TestWithParam<Case> {};

TEST_P(EveryTrustedProcess, MayDieOrFreezeInACallAsOneWithoutTrust) {
  Line sut({.point = GetParam().point, .trust = true});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  if (GetParam().fault == Fault::freeze) {
    ASSERT_NO_FATAL_FAILURE(sut.freeze(GetParam().victim));
  } else {
    sut.kill(GetParam().victim);
  }
  sut.expect_every_answer();
}

INSTANTIATE_TEST_SUITE_P(
    Crash, EveryTrustedProcess,
    testing::Values(Case{"GatewayWhileTheCallRuns", gateway, running, Fault::kill},
                    Case{"GatewayBeforeItReleasesTheProgram", gateway, before_release, Fault::kill},
                    Case{"ServiceWhileItRuns", service, running, Fault::kill},
                    Case{"ServiceWhileItRunsFrozen", service, running, Fault::freeze}),
    [](const testing::TestParamInfo<Case>& tested) { return tested.param.name; });

TEST(ATrustedAtMostOnceCall, IsBlockedUntilAnAuthorizedOperatorAnswers) {
  Line sut({.point = running, .at_most_once = true, .trust = true});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.kill(service);
  sut.answer_the_held_call();
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

// The response is in the journal of the gateway that was killed, and nowhere else.
TEST(AProgramWithHalfOfItsResponse, ContinuesWhenItsGatewayIsBackBesideTheOneThatTookOver) {
  Line sut({.point = before_clear, .standby = true});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.kill(gateway, true);
  sut.expect_every_answer();
}

struct OnceCase {
  const char* name;
  Victim victim;
  Point point;
  Fault fault;
  /// Whether the call must wait for an operator.
  bool held;
};

void PrintTo(const OnceCase& tested, std::ostream* out) {
  *out << tested.name;
}

class AnAtMostOnceCall : public testing::TestWithParam<OnceCase> {};

TEST_P(AnAtMostOnceCall, NeverRunsTwice) {
  Line sut({.point = GetParam().point, .at_most_once = true});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  if (GetParam().fault == Fault::freeze) {
    ASSERT_NO_FATAL_FAILURE(sut.freeze(GetParam().victim));
  } else {
    sut.kill(GetParam().victim);
  }
  if (GetParam().held) {
    sut.answer_the_held_call();
  }
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

INSTANTIATE_TEST_SUITE_P(
    Once, AnAtMostOnceCall,
    testing::Values(
        OnceCase{"ServiceKilledBeforeItBegins", service, dispatched, Fault::kill, true},
        OnceCase{"ServiceKilledWhileItRuns", service, running, Fault::kill, true},
        OnceCase{"ServiceKilledAfterItAnswered", service, answered, Fault::kill, false},
        OnceCase{"ServiceFrozenWhileItRuns", service, running, Fault::freeze, false},
        OnceCase{"GatewayKilledAfterItDispatched", gateway, dispatched, Fault::kill, false},
        OnceCase{"GatewayKilledWhileTheCallRuns", gateway, running, Fault::kill, false},
        OnceCase{"GatewayKilledBeforeItWritesTheAnswer", gateway, answered, Fault::kill, false},
        OnceCase{"GatewayKilledBeforeItReleasesTheProgram", gateway, before_release, Fault::kill,
                 false},
        OnceCase{"GatewayFrozenWhileTheCallRuns", gateway, running, Fault::freeze, false},
        OnceCase{"ControllerKilledWhileTheCallRuns", controller, running, Fault::kill, false}),
    [](const testing::TestParamInfo<OnceCase>& tested) { return tested.param.name; });

}  // namespace
}  // namespace millrace::tests::failures
