#include "fabric/profile/profile.hpp"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include "fabric/profile/credentials.hpp"
#include "idl/fabric.pb.h"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"
#include "tests/support/temporary_folder.hpp"

namespace millrace::fabric {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::filesystem::path config_file(const std::string& name) {
  return tests::test_data("config") / name;
}

TEST(Profile, FillsTheOptionsOfAParticipant) {
  const auto sut = profile::read_profile(config_file("good/two_networks.fabric.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->fabric, "hall-3");
  EXPECT_EQ(sut->domain, 7);
  EXPECT_EQ(sut->lease, std::chrono::seconds(2));
  EXPECT_THAT(sut->configuration, HasSubstr(R"(<NetworkInterface name="eth1"/>)"));
}

TEST(Profile, StaysOnLoopbackWithMulticastByDefault) {
  EXPECT_EQ(profile::cyclone_configuration(config::Fabric()),
            R"(<General><Interfaces><NetworkInterface name="lo" multicast="true"/></Interfaces>)"
            R"(<AllowMulticast>spdp</AllowMulticast></General><Discovery></Discovery>)");
}

TEST(Profile, NamesAnInterfaceByItsAddressToo) {
  config::Fabric profile;
  profile.set_interface("10.77.0.1");
  EXPECT_THAT(profile::cyclone_configuration(profile),
              HasSubstr(R"(<NetworkInterface address="10.77.0.1"/>)"));
}

TEST(Profile, UsesKnownPortsWherePeersLookForThem) {
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
  tests::expect_mistakes("fabric", [](const auto& file) {
    const auto sut = profile::read_profile(file);
    return sut ? "no error" : sut.error();
  });
}

// Joining a network needs trust, which has to be issued first; nothing else is missing.
TEST(Profile, ReadsTheProfilesThatAreShipped) {
  for (const auto& entry : std::filesystem::directory_iterator(MILLRACE_PROFILES)) {
    const auto sut = profile::read_profile(entry.path());
    if (entry.path().filename() == "one_host.fabric.textproto") {
      EXPECT_TRUE(sut) << sut.error();
      continue;
    }
    ASSERT_FALSE(sut) << entry.path();
    EXPECT_THAT(sut.error(), HasSubstr("trust.folder: $CREDENTIALS_DIRECTORY is not set"));
    EXPECT_EQ(std::ranges::count(sut.error(), '\n'), 0) << sut.error();
  }
}

/// The environment that systemd gives a unit with LoadCredential=.
class CredentialsOfSystemd : public testing::Test {
 protected:
  ~CredentialsOfSystemd() override { ::unsetenv("CREDENTIALS_DIRECTORY"); }
  [[nodiscard]] std::string why_refused(const std::string& folder) const {
    const std::filesystem::path file = temporary_.path() / "fabric.textproto";
    std::ofstream(file) << "trust { folder: \"" << folder << "\" }\n";
    const auto sut = profile::read_profile(file);
    return sut ? "not refused" : sut.error();
  }
  tests::TemporaryFolder temporary_;
};

TEST_F(CredentialsOfSystemd, AreReadFromItsFolder) {
  std::filesystem::create_directory(temporary_.path() / "here");
  ::setenv("CREDENTIALS_DIRECTORY", temporary_.path().c_str(), 1);
  EXPECT_THAT(why_refused("$CREDENTIALS_DIRECTORY"),
              HasSubstr((temporary_.path() / "certificate.pem").string() + ": cannot be read"));
  EXPECT_THAT(
      why_refused("$CREDENTIALS_DIRECTORY/here"),
      HasSubstr((temporary_.path() / "here" / "certificate.pem").string() + ": cannot be read"));
}

TEST_F(CredentialsOfSystemd, AreReportedAsMissingOutsideAUnit) {
  for (const char* value : {"", static_cast<const char*>(nullptr)}) {
    value == nullptr ? ::unsetenv("CREDENTIALS_DIRECTORY")
                     : ::setenv("CREDENTIALS_DIRECTORY", value, 1);
    EXPECT_THAT(why_refused("$CREDENTIALS_DIRECTORY"),
                AllOf(HasSubstr("$CREDENTIALS_DIRECTORY is not set"),
                      HasSubstr("install-trust --owner USER NAME")));
  }
}

TEST_F(CredentialsOfSystemd, AreNoPartOfAnotherName) {
  ::setenv("CREDENTIALS_DIRECTORY", temporary_.path().c_str(), 1);
  EXPECT_THAT(why_refused("$CREDENTIALS_DIRECTORY.old"), HasSubstr("expected"));
}

/// The folder of a host with the credentials of units and users.
class CredentialsOfUsers : public testing::Test {
 protected:
  void made_for(const std::string& name, std::optional<uid_t> user = {}) {
    std::filesystem::create_directory(host_.path() / name);
    if (user) {
      ASSERT_EQ(::chown((host_.path() / name).c_str(), *user, *user), 0);
    }
  }
  [[nodiscard]] std::string found_by(uid_t user) const {
    const auto sut = profile::credentials_of_user(host_.path(), user);
    return sut ? sut->filename().string() : sut.error();
  }
  tests::TemporaryFolder host_;
  uid_t self_ = ::geteuid();
};

TEST_F(CredentialsOfUsers, AreTheFolderOfTheUserAndNeverThatOfAUnit) {
  made_for("millrace-gateway");
  made_for("office");
  EXPECT_EQ(found_by(self_), "office");
  made_for("test-bench");
  EXPECT_THAT(found_by(self_),
              AllOf(HasSubstr("office, test-bench"), HasSubstr("--fabric-config")));
}

TEST_F(CredentialsOfUsers, AreReportedAsMissingToAUserWithoutAFolder) {
  EXPECT_THAT(found_by(self_ + 1), HasSubstr("install-trust --owner USER NAME"));
  made_for("office");
  EXPECT_THAT(found_by(self_ + 1), HasSubstr("has none"));
}

TEST_F(CredentialsOfUsers, OfTheOnlyUserAreThoseOfRootToo) {
  if (self_ != 0) {
    GTEST_SKIP() << "needs root to make folders of other users";
  }
  made_for("office", 4711);
  EXPECT_EQ(found_by(0), "office");
  EXPECT_EQ(found_by(4711), "office");
  EXPECT_THAT(found_by(4712), HasSubstr("has none"));
  made_for("root");
  EXPECT_EQ(found_by(0), "root");
}

}  // namespace
}  // namespace millrace::fabric
