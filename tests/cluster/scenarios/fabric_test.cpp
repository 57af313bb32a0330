// Who belongs together: hosts without multicast, several fabrics on one network, the profiles that
// are shipped.
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"

namespace millrace::tests::cluster {
namespace {

using testing::Each;
using testing::Field;

class TheFabric : public Scenario {};

TEST_P(TheFabric, ReachesAHostWithoutMulticastByItsPeers) {
  sut().network().stop_multicast("service-1");
  sut().set_profile("service-1", "many_networks.fabric.textproto");
  sut().service("service-1", "slow-1");
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  sut().expect_all_answered();
}

TEST_P(TheFabric, ConsistsOfPeersOnlyWhereNobodyHasMulticast) {
  for (const char* host : {"gateway", "service-1", "service-2"}) {
    sut().network().stop_multicast(host);
    sut().set_profile(host, "many_networks.fabric.textproto");
  }
  sut().service("service-1", "slow-1");
  sut().service("service-2", "slow-2");
  sut().gateway();
  sut().cnc({.channels = 2, .calls = 10});
  sut().expect_all_answered();
}

TEST_P(TheFabric, StaysOnOneHostByDefault) {
  sut().set_profile("gateway", "one_host.fabric.textproto");
  sut().set_profile("service-1", "one_host.fabric.textproto");
  sut().service("service-1", "elsewhere");
  sut().service("gateway", "here");
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  sut().expect_all_answered();
  EXPECT_THAT(sut().history().executions, Each(Field(&Execution::service, "here")));
}

TEST_P(TheFabric, HearsNobodyOfAnotherDomainOrName) {
  sut().service("service-1", "other-domain", {"--domain", "9"});
  sut().service("service-2", "other-name", {"--fabric", "hall-2"});
  Task& gateway = sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  gateway.await_log("served by nobody");
  sut().service("service-3", "ours");
  sut().expect_all_answered();
  EXPECT_THAT(sut().history().executions, Each(Field(&Execution::service, "ours")));
}

INSTANTIATE_TEST_SUITE_P(Cluster, TheFabric, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
