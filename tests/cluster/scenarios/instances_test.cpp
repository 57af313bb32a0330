// A second instance on another host takes over.
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::HasSubstr;

class ASecondInstance : public Scenario {};

TEST_P(ASecondInstance, TakesOverFromAHostThatWasCutOffAndDoesNotRunItsCallsTwice) {
  // On two hosts; the first names the channel, so it gets every call.
  sut().service("service-1", "first", {"--work", "200", "--channel", "cnc/1"});
  sut().service("service-2", "second", {"--work", "20"});
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 20});
  sut().task("first").await_log("call .* attempt 1");
  sut().network().cut("service-1");
  const Stopwatch watch;
  sut().task("second").await_log("call .* attempt 2");
  report("take-over", watch.time());
  EXPECT_LE(watch.time(), std::chrono::seconds(1));
  sut().task("first").await_log("call .* answered");
  sut().network().heal();
  // It has returned and gets every call of its channel again.
  sut().task("gateway").await_log(
      "instance .* is ready: first .*\n(.*\n)*.*instance .* is ready: first");
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

// More instances of a UUID under load.

constexpr std::size_t sample = 40;

class ASlowService : public Scenario {
 protected:
  void start(const std::string& host, const std::string& name) {
    sut().service(host, name, {"--work", "100"});
  }
  double calls_per_second() {
    return static_cast<double>(sample) / sut().await_finished(sample).count();
  }
};

TEST_P(ASlowService, AnswersMoreCallsWithFourInstancesThanWithOneAndLosesNone) {
  start("service-1", "slow-1");
  sut().gateway();
  sut().cnc({.channels = 4, .calls = 60});
  sut().await_finished(1);
  const double alone = calls_per_second();
  start("service-1", "slow-2");
  start("service-2", "slow-3");
  start("service-3", "slow-4");
  sut().await_finished(8);  // all four have begun
  const double together = calls_per_second();
  fmt::print("measured: {:.1f} calls/s with one instance, {:.1f} with four\n", alone, together);
  EXPECT_GT(together, 2.5 * alone);
  sut().expect_all_answered();
}

TEST_P(ASlowService, LosesNothingWhenItsInstancesLeaveOneAfterTheOther) {
  start("service-1", "slow-1");
  start("service-2", "slow-2");
  start("service-3", "slow-3");
  sut().gateway();
  sut().cnc({.channels = 3, .calls = 20});
  for (const char* name : {"slow-1", "slow-2"}) {
    sut().await_finished(6);
    sut().task(name).terminate();
    EXPECT_EQ(sut().task(name).wait(), 0) << sut().task(name).log();
  }
  sut().expect_all_answered();
}

INSTANTIATE_TEST_SUITE_P(Cluster, ASlowService, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
