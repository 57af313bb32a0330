#include "fabric/dds/configuration.hpp"

#include <fstream>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/trust_watch.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::fabric {
namespace {

using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

const std::string loopback = "name=\"lo\"";

TEST(CycloneConfiguration, StaysOnLoopback) {
  EXPECT_THAT(dds::cyclone_configuration({}, ""), HasSubstr(loopback));
  EXPECT_THAT(dds::cyclone_configuration({}, "<Tracing><Verbosity>fine</Verbosity></Tracing>"),
              HasSubstr(loopback));
}

TEST(CycloneConfiguration, PutsTheUsersSettingsLastSoThatTheyWin) {
  EXPECT_THAT(dds::cyclone_configuration({.configuration = "<A/>"}, ""), EndsWith(",<A/>"));
  EXPECT_THAT(dds::cyclone_configuration({}, "<B/>"), EndsWith(",<B/>"));
}

// Cyclone combines interfaces: one named by both would be an error.
TEST(CycloneConfiguration, IgnoresTheEnvironmentOfAProgramWithASettingOfItsOwn) {
  for (const dds::Finding finding : {dds::Finding::discovers, dds::Finding::announces}) {
    const dds::ParticipantOptions options{.finding = finding, .configuration = "<A/>"};
    EXPECT_EQ(dds::cyclone_configuration(options, loopback),
              dds::cyclone_configuration(options, ""));
  }
}

// Otherwise Cyclone's request shares a packet with the end of a handshake, which Fast DDS then
// drops.
TEST(CycloneConfiguration, DelaysRequestsUntilAHandshakeIsOver) {
  EXPECT_THAT(dds::cyclone_configuration({.trust = std::make_shared<const dds::Trust>()}, ""),
              HasSubstr("<PreEmptiveAckDelay>40ms"));
  EXPECT_THAT(dds::cyclone_configuration({}, ""), Not(HasSubstr("<PreEmptiveAckDelay>40ms")));
}

TEST(CycloneConfiguration, LeavesTheInterfaceToASettingThatNamesOne) {
  const std::string named = R"(<General><NetworkInterfaceAddress>eth1</NetworkInterfaceAddress>)";
  EXPECT_THAT(dds::cyclone_configuration({.configuration = named}, ""), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration({}, named), Not(HasSubstr(loopback)));
}

TEST(CycloneConfiguration, FindsAnInterfaceInFiles) {
  const tests::TemporaryFolder folder;
  const auto file = folder.path() / "dds.xml";
  std::ofstream(file) << R"(<Interfaces><NetworkInterface name="eth1"/></Interfaces>)";
  EXPECT_THAT(dds::cyclone_configuration({}, "file://" + file.string()), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration({}, "<A/>," + file.string()), Not(HasSubstr(loopback)));
  EXPECT_THAT(dds::cyclone_configuration({}, "file:///no/such/file"), HasSubstr(loopback));
}

TEST(CycloneConfiguration, HasAServiceAnnounceItselfByMulticast) {
  const std::string sut =
      dds::cyclone_configuration({.domain = 3, .finding = dds::Finding::announces}, "");
  EXPECT_THAT(sut, HasSubstr("<AllowMulticast>false"));
  EXPECT_THAT(sut, HasSubstr("239.255.0.1:8150"));
  EXPECT_THAT(dds::cyclone_configuration({}, ""), Not(HasSubstr("239.255.0.1")));
}

TEST(CycloneConfiguration, LeavesThePortsToASettingThatChoosesThem) {
  const std::string lowest = "<MaxAutoParticipantIndex>100<";
  EXPECT_THAT(dds::cyclone_configuration({}, ""), HasSubstr(lowest));
  EXPECT_THAT(dds::cyclone_configuration({.configuration = "<A/>"}, ""), HasSubstr(lowest));
  EXPECT_THAT(dds::cyclone_configuration({}, "", dds::Ports::any), Not(HasSubstr(lowest)));
  const std::string few = "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>";
  EXPECT_THAT(dds::cyclone_configuration({.configuration = few}, ""), Not(HasSubstr(lowest)));
  EXPECT_THAT(dds::cyclone_configuration({}, "<A/>"), Not(HasSubstr(lowest)));
}

TEST(CycloneConfiguration, LeavesDiscoveryOfAServiceToTheUsersSettings) {
  for (const std::string users :
       {"<Discovery><Peers><Peer Address=\"10.0.0.1\"/></Peers></Discovery>",
        "<General><AllowMulticast>false</AllowMulticast></General>"}) {
    EXPECT_THAT(dds::cyclone_configuration(
                    {.finding = dds::Finding::announces, .configuration = users}, ""),
                Not(HasSubstr("239.255.0.1")));
  }
  EXPECT_THAT(dds::cyclone_configuration({.finding = dds::Finding::announces}, "<A/>"),
              Not(HasSubstr("239.255.0.1")));
}

}  // namespace
}  // namespace millrace::fabric
