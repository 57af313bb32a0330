// The gateway is killed or restarted during calls.
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::Each;
using testing::Field;

class AGatewayInMidCall : public Scenario {
 protected:
  void start() {
    sut().service("service-1", "slow-1", {"--work", "300"});
    sut().service("service-2", "slow-2", {"--work", "300"});
    sut().gateway();
    sut().cnc({.channels = 2, .calls = 6});
    sut().await_finished(2);
    sut().task("slow-1").await_log("call .* attempt 1");
  }

  /// Each call was dispatched once and ran once, even if a later gateway handled its answer.
  void expect_first_attempts_only() {
    EXPECT_THAT(sut().history().executions, Each(Field(&Execution::attempt, 1)));
  }
};

TEST_P(AGatewayInMidCall, ResumesTheCallsOfOneThatWasKilled) {
  start();
  sut().task("gateway").kill();
  sut().gateway();
  sut().expect_all_answered();
  expect_first_attempts_only();
}

TEST_P(AGatewayInMidCall, CanBeReplacedByANewerOne) {
  start();
  sut().task("gateway").terminate();
  EXPECT_EQ(sut().task("gateway").wait(), 0);
  sut().gateway();
  sut().expect_all_answered();
  expect_first_attempts_only();
}

INSTANTIATE_TEST_SUITE_P(Cluster, AGatewayInMidCall, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
