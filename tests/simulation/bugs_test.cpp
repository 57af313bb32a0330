// The simulation finds each deliberate mistake (gateway/bug.hpp).
#include <algorithm>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/simulation/world.hpp"

namespace millrace::tests::simulation {
namespace {

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

INSTANTIATE_TEST_SUITE_P(Of, Mistake, testing::ValuesIn(bug_names), [](const auto& one) {
  std::string name(one.param.name);
  std::ranges::replace(name, '-', '_');
  return name;
});

}  // namespace
}  // namespace millrace::tests::simulation
