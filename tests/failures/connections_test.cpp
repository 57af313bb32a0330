// The connection between gateway and controller is broken at each frame that matters.
#include <array>
#include <string>

#include <gtest/gtest.h>

#include "tests/failures/line.hpp"

namespace millrace::tests::failures {
namespace {

struct Break {
  const char* name;
  Point point;
  void (AdsProxy::*how)();
  /// The fault happens at any bytes while the call runs.
  bool secure = false;
};

void PrintTo(const Break& fault, std::ostream* out) {
  *out << fault.name;
}

void reach(Line& sut, const Break& fault) {
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  if (fault.secure) {
    sut.proxy().arm();
    ASSERT_TRUE(sut.proxy().await_held()) << sut.gateway().error_output();
  }
}

class AConnection : public testing::TestWithParam<Break> {};

TEST_P(AConnection, MayBreakAtAnyFrameOfACall) {
  Line sut({.point = GetParam().point, .secure = GetParam().secure});
  ASSERT_NO_FATAL_FAILURE(reach(sut, GetParam()));
  (sut.proxy().*GetParam().how)();
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

using enum Point;

INSTANTIATE_TEST_SUITE_P(
    Broken, AConnection,
    testing::Values(
        Break{"CutBeforeTheTextsAreRead", before_accept, &AdsProxy::cut_before},
        Break{"CutAfterTheTextsAreRead", before_accept, &AdsProxy::cut_after},
        Break{"CutBeforeAnInterimState", interim, &AdsProxy::cut_before},
        Break{"CutAfterAnInterimState", interim, &AdsProxy::cut_after},
        Break{"CutBeforeTheResponse", answered, &AdsProxy::cut_before},
        Break{"CutAfterTheResponse", answered, &AdsProxy::cut_after},
        Break{"CutBeforeTheRequestIsCleared", before_clear, &AdsProxy::cut_before},
        Break{"CutAfterTheRequestIsCleared", before_clear, &AdsProxy::cut_after},
        Break{"CutBeforeTheProgramIsReleased", before_release, &AdsProxy::cut_before},
        Break{"CutAfterTheProgramIsReleased", before_release, &AdsProxy::cut_after},
        Break{"HalfOpenBeforeTheTextsAreRead", before_accept, &AdsProxy::go_silent},
        Break{"HalfOpenBeforeTheResponse", answered, &AdsProxy::go_silent},
        Break{"HalfOpenAfterTheRequestIsCleared", before_clear, &AdsProxy::go_silent_after},
        Break{"HalfOpenAfterTheProgramIsReleased", before_release, &AdsProxy::go_silent_after}),
    [](const testing::TestParamInfo<Break>& tested) { return tested.param.name; });

INSTANTIATE_TEST_SUITE_P(
    Secure, AConnection,
    testing::Values(Break{"SecureAndCut", running, &AdsProxy::cut_before, true},
                    Break{"SecureAndHalfOpen", running, &AdsProxy::go_silent_after, true}),
    [](const testing::TestParamInfo<Break>& tested) { return tested.param.name; });

/// A frame arrives after the gateway has given it up: nothing is written twice.
class AStall : public testing::TestWithParam<Break> {};

TEST_P(AStall, DelaysACallAndNothingElse) {
  Line sut({.point = GetParam().point, .secure = GetParam().secure});
  ASSERT_NO_FATAL_FAILURE(reach(sut, GetParam()));
  sut.gateway().await_error(
      "may or may not have reached the controller|refuses to read the Service");
  sut.proxy().release();
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

INSTANTIATE_TEST_SUITE_P(Slow, AStall,
                         testing::Values(Break{"OfARead", before_accept, nullptr},
                                         Break{"OfTheResponse", answered, nullptr},
                                         Break{"OfTheClearedRequest", before_clear, nullptr},
                                         Break{"OfTheRelease", before_release, nullptr},
                                         Break{"OfSecureAds", running, nullptr, true}),
                         [](const testing::TestParamInfo<Break>& tested) {
                           return tested.param.name;
                         });

/// Its frames do not count: a path that answers nothing cannot serve a call.
class AControllerThatOnlySeemsAlive : public testing::TestWithParam<AdsProxy::Chatter> {};

TEST_P(AControllerThatOnlySeemsAlive, IsDownWithinThreeSecondsAndNoCallIsLost) {
  Line sut({.point = Point::running});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.proxy().answer_nothing(GetParam());
  sut.gateway().await_error("link down: [^ ]+ does not answer: no response for 2\\.[0-9] s");
  sut.proxy().answer();
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

TEST(ARouterWithoutACnc, IsReportedWithItsReasonAndNoCallIsLost) {
  Line sut({.point = Point::running});
  ASSERT_NO_FATAL_FAILURE(sut.reach());
  sut.proxy().answer_nothing(AdsProxy::Chatter::router_errors);
  sut.gateway().await_error(
      "link down: [^ ]+ answers, but nothing serves its AMS port 552: does the CNC run\\?");
  sut.proxy().answer();
  sut.expect_every_answer();
  sut.expect_no_call_ran_twice();
}

std::string name_of(const testing::TestParamInfo<AdsProxy::Chatter>& sent) {
  constexpr std::array names{"StateRequests", "MirroredFrames", "Notifications"};
  return names.at(static_cast<std::size_t>(sent.param));
}

INSTANTIATE_TEST_SUITE_P(ThatSends, AControllerThatOnlySeemsAlive,
                         testing::Values(AdsProxy::Chatter::state_requests,
                                         AdsProxy::Chatter::mirrored_frames,
                                         AdsProxy::Chatter::notifications),
                         name_of);

}  // namespace
}  // namespace millrace::tests::failures
