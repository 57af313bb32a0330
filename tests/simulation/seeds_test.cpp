// 300 plants, each with its own faults. A failure names the seed and how to replay it. CTest also
// runs new seeds (CMakeLists.txt).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/simulation/world.hpp"

namespace millrace::tests::simulation {
namespace {

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

}  // namespace
}  // namespace millrace::tests::simulation
