// Services on several hosts answer by UUID.
#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

class ServicesOnThreeHosts : public Scenario {};

TEST_P(ServicesOnThreeHosts, ShareTheCallsOfTheirUuid) {
  for (const char* number : {"1", "2", "3"}) {
    sut().service(std::string("service-") + number, std::string("slow-") + number, {"--work", "5"});
  }
  sut().gateway();
  sut().cnc({.channels = 3, .calls = 30});
  sut().expect_all_answered();
}

INSTANTIATE_TEST_SUITE_P(Cluster, ServicesOnThreeHosts, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
