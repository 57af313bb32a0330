// A simulation that aborts names its seed.
#include <cstdint>
#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/simulation/world.hpp"

namespace millrace::tests::simulation {
namespace {

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
