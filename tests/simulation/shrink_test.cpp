// The reduction of a failing simulation.
#include "tests/simulation/shrink.hpp"

#include <gtest/gtest.h>

namespace millrace::tests::simulation {
namespace {

class Shrinking : public testing::Test {
 protected:
  /// A seed with several programs and kinds of faults that fails with a deliberate mistake.
  const std::uint64_t seed = 7;
  const Options options{.bug = Bug::instance_loss_ignored};
  const Outcome failed = World(seed, options).run();
};

TEST_F(Shrinking, LeavesASmallerSimulationThatViolatesTheSameInvariant) {
  ASSERT_FALSE(failed.violations.empty());
  Options small = options;
  small.limits = shrink(seed, options, failed);
  EXPECT_FALSE(small.limits.quiet.empty());
  EXPECT_GT(small.limits.without.size(), FaultInjector::names().size() / 2);
  const Outcome outcome = World(seed, small).run();
  ASSERT_FALSE(outcome.violations.empty());
  EXPECT_EQ(outcome.violations.front().substr(0, 3), failed.violations.front().substr(0, 3));
  EXPECT_LE(outcome.faults_for, failed.faults_for);
}

TEST_F(Shrinking, LeavesNothingOutOfASimulationThatHoldsIfItFailsWithoutIt) {
  ASSERT_FALSE(failed.violations.empty());
  Options small = options;
  small.limits = shrink(seed, options, failed);
  for (const std::string& fault : FaultInjector::names()) {
    Options smaller = small;
    if (smaller.limits.without.insert(fault).second) {
      const Outcome outcome = World(seed, smaller).run();
      EXPECT_TRUE(outcome.violations.empty() ||
                  outcome.violations.front().substr(0, 3) != failed.violations.front().substr(0, 3))
          << fault;
    }
  }
}

}  // namespace
}  // namespace millrace::tests::simulation
