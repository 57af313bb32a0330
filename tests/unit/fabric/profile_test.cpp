#include "fabric/profile/profile.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "idl/fabric.pb.h"

namespace millrace::fabric {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::filesystem::path data(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

std::string mistakes(const std::string& name) {
  const auto sut = profile::read_profile(data("bad/" + name));
  return sut ? "none" : sut.error();
}

TEST(Profile, FillsTheOptionsOfAParticipant) {
  const auto sut = profile::read_profile(data("good/two_networks.fabric.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->fabric, "hall-3");
  EXPECT_EQ(sut->domain, 7);
  EXPECT_EQ(sut->lease, std::chrono::seconds(2));
  EXPECT_THAT(sut->configuration, HasSubstr(R"(<NetworkInterface name="eth1"/>)"));
}

TEST(Profile, StaysOnLoopbackWithMulticastIfTheFileSaysNothing) {
  EXPECT_EQ(profile::cyclone_configuration(config::Fabric()),
            R"(<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>)"
            R"(<AllowMulticast>spdp</AllowMulticast></General>)"
            R"(<Discovery><ParticipantIndex>none</ParticipantIndex></Discovery>)");
}

TEST(Profile, NamesAnInterfaceByItsAddressToo) {
  config::Fabric profile;
  profile.set_interface("10.77.0.1");
  EXPECT_THAT(profile::cyclone_configuration(profile),
              HasSubstr(R"(<NetworkInterface address="10.77.0.1"/>)"));
}

TEST(Profile, GivesProgramsKnownPortsWherePeersLookForThem) {
  config::Fabric profile;
  profile.add_peers("gateway-1");
  EXPECT_THAT(profile::cyclone_configuration(profile),
              AllOf(HasSubstr(R"(<Peers><Peer Address="gateway-1"/></Peers>)"),
                    HasSubstr("<ParticipantIndex>auto</ParticipantIndex>"),
                    HasSubstr("<MaxAutoParticipantIndex>20</MaxAutoParticipantIndex>"),
                    HasSubstr("<AllowMulticast>spdp</AllowMulticast>")));
}

TEST(Profile, FindsTheProgramsOfItsOwnHostWithoutMulticast) {
  config::Fabric profile;
  profile.set_multicast(false);
  profile.set_processes_per_host(5);
  EXPECT_THAT(profile::cyclone_configuration(profile),
              AllOf(HasSubstr("<AllowMulticast>false</AllowMulticast>"),
                    HasSubstr(R"(<Peer Address="127.0.0.1"/>)"),
                    HasSubstr("<MaxAutoParticipantIndex>5</MaxAutoParticipantIndex>")));
}

TEST(Profile, NamesTheFieldThatDoesNotExist) {
  EXPECT_THAT(
      mistakes("misspelt_field.fabric.textproto"),
      AllOf(HasSubstr("misspelt_field.fabric.textproto:2:11: "), HasSubstr("\"interfaces\"")));
}

TEST(Profile, NamesEveryValueThatCannotBeWithItsPlace) {
  const std::string found = mistakes("wrong_values.fabric.textproto");
  EXPECT_THAT(found, HasSubstr(":1:1: fabric: \"hall/3\"; expected some text without"));
  EXPECT_THAT(found, HasSubstr(":2:1: domain: 300; expected 0 to 232"));
  EXPECT_THAT(found, HasSubstr(":3:1: interface: \"eth0,eth1\"; expected the name of a network"));
  EXPECT_THAT(found, HasSubstr(":4:1: peers: \"10.0.0.2:7410\"; expected a host's name"));
  EXPECT_THAT(found, HasSubstr(":5:1: processes_per_host: 0; expected 1 to 100"));
  EXPECT_THAT(found, HasSubstr(":6:1: lease_ms: 5; expected 100 to 100000"));
  EXPECT_THAT(found, Not(HasSubstr("10.0.0.1")));
}

TEST(Profile, ReadsTheProfilesThatAreShipped) {
  for (const auto& entry : std::filesystem::directory_iterator(MILLRACE_PROFILES)) {
    const auto sut = profile::read_profile(entry.path());
    EXPECT_TRUE(sut) << sut.error();
  }
}

}  // namespace
}  // namespace millrace::fabric
