// Network faults: a disconnected controller, lost and late frames.
#include <gmock/gmock.h>

#include "tests/cluster/scenarios/scenario.hpp"
#include "tests/cluster/scenarios/stopwatch.hpp"

namespace millrace::tests::cluster {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""min;
using testing::ContainsRegex;
using testing::Each;
using testing::Field;
using testing::HasSubstr;

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

// The extent of a fabric: hosts without multicast, several fabrics on one network, the shipped
// profiles.

class TheFabric : public Scenario {};

TEST_P(TheFabric, ReachesAHostWithoutMulticastByItsPeers) {
  sut().network().stop_multicast("service-1");
  sut().set_profile("service-1", "many_networks.fabric.textproto");
  sut().service("service-1", "slow-1");
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  sut().expect_all_answered();
}

TEST_P(TheFabric, ConsistsOfPeersWhereThereIsNoMulticast) {
  for (const char* host : {"gateway", "recorder", "service-1", "service-2"}) {
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
  sut().record_on("gateway");
  sut().set_profile("gateway", "one_host.fabric.textproto");
  sut().set_profile("service-1", "one_host.fabric.textproto");
  sut().service("service-1", "elsewhere");
  sut().service("gateway", "here");
  sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  sut().expect_all_answered();
  EXPECT_THAT(sut().history().executions, Each(Field(&Execution::service, "here")));
}

TEST_P(TheFabric, IgnoresOtherDomainsAndFabricNames) {
  sut().service("service-1", "other-domain", {"--domain", "9"});
  sut().service("service-2", "other-name", {"--fabric", "hall-2"});
  Task& gateway = sut().gateway();
  sut().cnc({.channels = 1, .calls = 10});
  gateway.await_log("no service has the UUID");
  sut().service("service-3", "ours");
  sut().expect_all_answered();
  EXPECT_THAT(sut().history().executions, Each(Field(&Execution::service, "ours")));
}

TEST_P(TheFabric, IsExplainedByTheDoctorWhereNoPeerIsFound) {
  sut().gateway();
  sut().service("service-1", "slow-1");
  const std::string well = sut().millrace("gateway", {"doctor", "--wait", "1s"}, 1);
  EXPECT_THAT(well, ContainsRegex("slow-1 .*serves c0ffee00"));
  EXPECT_THAT(well,
              HasSubstr("problem  cnc: no connection to the controller"));  // it is not started

  sut().network().stop_multicast("service-2");
  const std::string alone = sut().millrace("service-2", {"doctor", "--all", "--wait", "1s"}, 1);
  EXPECT_THAT(alone, HasSubstr("interface eth0 (10.77.0.5) is up"));
  EXPECT_THAT(alone, HasSubstr("no other process is on fabric 'millrace', domain 0"));
  EXPECT_THAT(alone, HasSubstr("no announcement came by multicast on eth0"));
  EXPECT_THAT(alone, HasSubstr("list the other hosts in peers"));

  sut().set_profile("service-2", "many_networks.fabric.textproto");
  const std::string found = sut().millrace("service-2", {"doctor", "--all", "--wait", "1s"}, 1);
  EXPECT_THAT(found, HasSubstr("peer 10.77.0.1 (10.77.0.1) responds"));
  EXPECT_THAT(found, HasSubstr("problem  cnc: no connection to the controller"));

  sut().network().cut("recorder");
  const std::string cut = sut().millrace("service-2", {"doctor", "--wait", "3s"}, 1);
  EXPECT_THAT(cut, ContainsRegex("problem  peer 10.77.0.2 (cannot be reached|does not respond)"));
}

INSTANTIATE_TEST_SUITE_P(Cluster, TheFabric, testing::ValuesIn(backends), name_of);

}  // namespace
}  // namespace millrace::tests::cluster
