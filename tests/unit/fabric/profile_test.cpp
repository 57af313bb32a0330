#include "fabric/profile/profile.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "idl/fabric.pb.h"
#include "tests/support/expected_mistakes.hpp"

namespace millrace::fabric {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::filesystem::path config_file(const std::string& name) {
  return std::filesystem::path(MILLRACE_TEST_DATA) / "config" / name;
}

TEST(Profile, FillsTheOptionsOfAParticipant) {
  const auto sut = profile::read_profile(config_file("good/two_networks.fabric.textproto"));
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

TEST(Profile, NamesEveryMistakeWithItsPlace) {
  for (const auto& file : tests::bad_configurations(MILLRACE_TEST_DATA, ".fabric.textproto")) {
    const auto sut = profile::read_profile(file);
    ASSERT_FALSE(sut);
    tests::expect_its_mistakes(file, sut.error());
  }
}

TEST(Profile, ReadsTheProfilesThatAreShipped) {
  for (const auto& entry : std::filesystem::directory_iterator(MILLRACE_PROFILES)) {
    const auto sut = profile::read_profile(entry.path());
    EXPECT_TRUE(sut) << sut.error();
  }
}

}  // namespace
}  // namespace millrace::fabric
