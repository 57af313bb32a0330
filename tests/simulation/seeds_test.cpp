// The reduction of a failing simulation.
#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/simulation/shrink.hpp"
#include "tests/simulation/world.hpp"

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

// 300 plants, each with its own faults. A failure names the seed and how to replay it. CTest also
// runs new seeds (CMakeLists.txt).

constexpr std::uint64_t seeds = 300;
constexpr std::uint64_t groups = 10;

class Seeds : public testing::TestWithParam<std::uint64_t> {};

TEST_P(Seeds, KeepAllInvariants) {
  std::size_t answered = 0;
  for (std::uint64_t seed = GetParam(); seed < GetParam() + seeds / groups; ++seed) {
    const Outcome outcome = World(seed, {}).run();
    answered += outcome.answered;
    EXPECT_TRUE(outcome.violations.empty()) << fmt::format(
        "{}\nreplay: {}", fmt::join(outcome.violations, "\n"), replay(seed, Bug::none));
  }
  EXPECT_GT(answered, seeds / groups) << "faults leave nothing to look at";
}

INSTANTIATE_TEST_SUITE_P(Of, Seeds, testing::Range<std::uint64_t>(1, seeds + 1, seeds / groups));

// The simulation finds each deliberate mistake (gateway/bug.hpp).

constexpr std::uint64_t enough_seeds = 2000;

class Mistake : public testing::TestWithParam<BugName> {};

TEST_P(Mistake, IsFound) {
  for (std::uint64_t seed = 1; seed <= enough_seeds; ++seed) {
    Options options;
    options.bug = GetParam().bug;
    const Outcome outcome = World(seed, options).run();
    if (!outcome.violations.empty()) {
      fmt::print("seed {}: {}\n", seed, outcome.violations.front());
      return;
    }
  }
  FAIL() << "not within " << enough_seeds << " seeds";
}

INSTANTIATE_TEST_SUITE_P(Of, Mistake, testing::ValuesIn(bug_names), [](const auto& tested) {
  std::string name(tested.param.name);
  std::ranges::replace(name, '-', '_');
  return name;
});

// A simulation that aborts names its seed.

/// Ends the process at the first event of a simulation.
void run_seed_17(Options options, void (*planted)()) {
  options.trace = [planted](const std::string&) { planted(); };
  World(17, options).run();
}

void write_to_null() {
  auto* const nowhere = reinterpret_cast<volatile int*>(std::uintptr_t{8});
  *nowhere = 1;
}

TEST(ASimulationDeathTest, ThatAbortsNamesItsSeedAndTheCommandThatRepeatsIt) {
  EXPECT_DEATH(run_seed_17({}, std::abort),
               "seed 17 ends by SIGABRT\n  replay: millrace-simulation --seed 17 --trace\n");
}

TEST(ASimulationDeathTest, ThatIsEndedByAWildPointerDoesSoToo) {
  EXPECT_DEATH(run_seed_17({}, write_to_null), "seed 17 ends by SIGSEGV");
}

TEST(ASimulationDeathTest, NamesTheMistakeThatIsMadeOnPurposeToo) {
  EXPECT_DEATH(run_seed_17({.bug = Bug::numbers_not_journalled}, std::abort),
               "--seed 17 --trace --bug numbers-not-journalled\n");
}

TEST(ASimulationDeathTest, ThatHasEndedIsNotNamedForALaterCrash) {
  World(17, {}).run();
  EXPECT_DEATH(std::abort(), testing::Not(testing::HasSubstr("seed 17")));
}

}  // namespace
}  // namespace millrace::tests::simulation
