// A second instance on another host takes over.
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::HasSubstr;

constexpr std::chrono::seconds allowed{1};

class ASecondInstance : public Scenario {
 protected:
  /// Two instances on two hosts; the first names the channel, so it gets every call.
  void start() {
    sut().service("service-1", "first", {"--work", "200", "--channel", "cnc/1"});
    sut().service("service-2", "second", {"--work", "20"});
    sut().gateway();
    sut().cnc({.channels = 1, .calls = 20});
    sut().task("first").await_log("call .* attempt 1");
  }

  void expect_takeover_in_time() {
    const Stopwatch watch;
    sut().task("second").await_log("call .* attempt 2");
    report("take-over", watch.time());
    EXPECT_LE(watch.time(), allowed);
  }
};

TEST_P(ASecondInstance, TakesOverFromOneThatWasKilled) {
  start();
  sut().task("first").kill();
  expect_takeover_in_time();
  sut().expect_all_answered();
}

TEST_P(ASecondInstance, TakesOverFromAHostThatWasCutOffAndDoesNotRunItsCallsTwice) {
  start();
  sut().network().cut("service-1");
  expect_takeover_in_time();
  sut().task("first").await_log("call .* answered");
  sut().network().heal();
  // It has returned and gets every call of its channel again.
  sut().task("gateway").await_log(
      "instance .* is ready: first .*\n(.*\n)*.*instance .* is ready: first");
  sut().expect_all_answered();
}

TEST_P(ASecondInstance, TakesOverFromOneThatIsFrozen) {
  start();
  sut().task("first").pause();
  expect_takeover_in_time();
  sut().task("first").resume();
  sut().expect_all_answered();
}

// A restarted instance must prove its identity again, across hosts, which takes more time.
class ATrustedPlant : public Scenario {};

TEST_P(ATrustedPlant, LosesNoCallWhenAnInstanceAHostAndTheGatewayAreLostOneAfterTheOther) {
  sut().with_trust();
  sut().service("service-1", "first", {"--work", "50"});
  sut().service("service-2", "second", {"--work", "50"});
  sut().gateway();
  sut().cnc({.channels = 2, .calls = 60});
  sut().await_finished(5);
  sut().task("first").kill();
  sut().await_finished(5);
  sut().service("service-3", "third", {"--work", "50"});
  sut().task("gateway").await_log("instance .* is ready: third");
  sut().network().cut("service-2");
  sut().await_finished(5);
  sut().network().heal();
  sut().task("gateway").kill();
  sut().gateway();
  EXPECT_THAT(sut().millrace("recorder", {"services"}), HasSubstr("third"));
  sut().expect_all_answered();
}

INSTANTIATE_TEST_SUITE_P(Cluster, ATrustedPlant, testing::ValuesIn(backends), name_of);

INSTANTIATE_TEST_SUITE_P(Cluster, ASecondInstance, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
