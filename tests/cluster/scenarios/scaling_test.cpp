// More instances of a UUID under load.
#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

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
