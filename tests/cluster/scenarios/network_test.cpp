// Network faults: a disconnected controller, lost and late frames.
#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""min;

class OverABadNetwork : public Scenario {};

TEST_P(OverABadNetwork, AControllerThatIsUnpluggedContinuesWhenItIsBack) {
  sut().service("service-1", "slow-1", {"--work", "50"});
  Task& gateway = sut().gateway();
  sut().cnc({.channels = 2, .calls = 20});
  sut().await_finished(5);
  sut().network().cut("controller");
  gateway.await_log("cnc: link down");
  sut().network().heal();
  sut().expect_all_answered();
}

TEST_P(OverABadNetwork, EveryCallIsAnsweredAlthoughATenthOfTheFramesIsLostAndTheOthersAreLate) {
  for (const char* number : {"1", "2", "3"}) {
    sut().service(std::string("service-") + number, std::string("slow-") + number,
                  {"--work", "20"});
  }
  sut().gateway();
  sut().cnc({.channels = 4, .calls = 500});
  sut().await_finished(10);
  sut().network().loss(0.1);
  sut().network().delay(20ms, 10ms);
  const Stopwatch bad;
  while (bad.time() < 1min) {
    sut().await_finished(1);  // throws if calls stop
  }
  const std::size_t finished = sut().finished();
  fmt::print("measured: {} calls in a minute with 10 % loss and 20 ms ± 10 ms delay\n", finished);
  sut().network().loss(0);
  sut().network().delay(0ms, 0ms);
  sut().expect_all_answered(1min);
}

INSTANTIATE_TEST_SUITE_P(Cluster, OverABadNetwork, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
