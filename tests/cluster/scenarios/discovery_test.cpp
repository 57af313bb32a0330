// The time from the start of a service to its first answer.
#include <algorithm>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

constexpr int rounds = 11;
constexpr Stopwatch::Seconds allowed{0.5};

class AService : public Scenario {};

TEST_P(AService, AnswersAWaitingCallSoonAfterItsStart) {
  sut().gateway();
  sut().cnc({.channels = 1, .calls = rounds * 100'000});
  std::vector<Stopwatch::Seconds> times;
  for (int round = 0; round < rounds; ++round) {
    const std::string name = "slow-" + std::to_string(round);
    const Stopwatch watch;
    Task& service = sut().service("service-1", name);
    service.await_log("call .* answered");
    times.push_back(watch.time());
    service.terminate();
    EXPECT_EQ(service.wait(), 0);
  }
  std::ranges::nth_element(times, times.begin() + rounds / 2);
  report("from the start of a service to its first answer, median", times[rounds / 2]);
  if (GetParam() == Backend::namespaces) {  // the engine starts containers, at its own speed
    EXPECT_LE(times[rounds / 2], allowed);
  }
}

INSTANTIATE_TEST_SUITE_P(Cluster, AService, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
