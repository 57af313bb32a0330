// A service whose calls must not be repeated, and the ways to lose its instance.
#include <algorithm>

#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::HasSubstr;

class AnAtMostOnceCallOfAHost : public Scenario {
 protected:
  /// Two instances on two hosts; the first names the channel, so it gets every call, and its first
  /// call takes long.
  void start() {
    sut().service("service-1", "first",
                  {"--delivery", "at-most-once", "--work", "600", "--channel", "cnc/1"});
    sut().service("service-2", "second", {"--delivery", "at-most-once"});
    sut().gateway();
    // It finds each one with that one's next announcement.
    sut().task("gateway").await_log("is ready: first");
    sut().task("gateway").await_log("is ready: second");
    sut().cnc({.channels = 1, .calls = 5});
    sut().task("first").await_log("call .* attempt 1");
  }

  /// Waits until the gateway has blocked the call, and answers it in the service's place.
  void answer_as_an_operator() {
    sut().task("gateway").await_log("must not run twice");
    EXPECT_THAT(sut().millrace("recorder", {"channels"}), HasSubstr("held"));
    EXPECT_THAT(sut().millrace("recorder", {"answer", "cnc/1", "1", "--state", "1"}),
                HasSubstr("of cnc/1: "));
  }

  /// How often a handler was started for the first call of the program.
  [[nodiscard]] std::size_t starts_of_the_first_call() {
    const History history = sut().history();
    const std::string call = history.executions.at(0).call;
    return static_cast<std::size_t>(std::ranges::count_if(
        history.executions,
        [&](const Execution& each) { return each.step == Step::started && each.call == call; }));
  }
};

TEST_P(AnAtMostOnceCallOfAHost, IsBlockedForAnOperatorWhenItsInstanceIsKilled) {
  start();
  sut().task("first").kill();
  answer_as_an_operator();
  sut().expect_all_answered();
  EXPECT_EQ(starts_of_the_first_call(), 1U);
}

TEST_P(AnAtMostOnceCallOfAHost, IsBlockedForAnOperatorWhenItIsCutOff) {
  start();
  sut().network().cut("service-1");
  answer_as_an_operator();
  sut().network().heal();
  sut().expect_all_answered();
  EXPECT_EQ(starts_of_the_first_call(), 1U);
}

INSTANTIATE_TEST_SUITE_P(Cluster, AnAtMostOnceCallOfAHost, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
