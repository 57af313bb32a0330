// A gateway that is replaced, or an at-most-once instance that is cut off, during calls.
#include <algorithm>

#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::Each;
using testing::Field;
using testing::HasSubstr;

class AGatewayInMidCall : public Scenario {};

TEST_P(AGatewayInMidCall, CanBeReplacedByANewerOne) {
  sut().service("service-1", "slow-1", {"--work", "300"});
  sut().service("service-2", "slow-2", {"--work", "300"});
  sut().gateway();
  sut().cnc({.channels = 2, .calls = 6});
  sut().await_finished(2);
  sut().task("slow-1").await_log("call .* attempt 1");
  sut().task("gateway").terminate();
  EXPECT_EQ(sut().task("gateway").wait(), 0);
  sut().gateway();
  sut().expect_all_answered();
  // Each call was dispatched once and ran once, even if the later gateway handled its answer.
  EXPECT_THAT(sut().history().executions, Each(Field(&Execution::attempt, 1)));
}

INSTANTIATE_TEST_SUITE_P(Cluster, AGatewayInMidCall, testing::ValuesIn(backends), name_of);

class AnAtMostOnceCallOfAHost : public Scenario {};

TEST_P(AnAtMostOnceCallOfAHost, IsBlockedForAnOperatorWhenItIsCutOff) {
  // On two hosts; the first names the channel, so it gets every call, and its first call takes
  // long.
  sut().service("service-1", "first",
                {"--delivery", "at-most-once", "--work", "600", "--channel", "cnc/1"});
  sut().service("service-2", "second", {"--delivery", "at-most-once"});
  sut().gateway();
  // It finds each one with that one's next announcement.
  sut().task("gateway").await_log("is ready: first");
  sut().task("gateway").await_log("is ready: second");
  sut().cnc({.channels = 1, .calls = 5});
  sut().task("first").await_log("call .* attempt 1");
  sut().network().cut("service-1");
  // An operator answers in the service's place.
  sut().task("gateway").await_log("must not run twice");
  EXPECT_THAT(sut().millrace("recorder", {"channels"}), HasSubstr("held"));
  EXPECT_THAT(sut().millrace("recorder", {"answer", "cnc/1", "1", "--state", "1"}),
              HasSubstr("of cnc/1: "));
  sut().network().heal();
  sut().expect_all_answered();
  const History history = sut().history();
  const auto first_call = [&](const Execution& each) {
    return each.step == Step::started && each.call == history.executions.at(0).call;
  };
  EXPECT_EQ(std::ranges::count_if(history.executions, first_call), 1);
}

INSTANTIATE_TEST_SUITE_P(Cluster, AnAtMostOnceCallOfAHost, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
