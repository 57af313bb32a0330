#include "fabric/dds/participant.hpp"

#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#ifdef __SANITIZE_ADDRESS__
#include <sanitizer/lsan_interface.h>
#endif

#include "fabric/dds/configuration.hpp"
#include "fabric/dds/trust_watch.hpp"
#include "tests/support/domain.hpp"
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

TEST(CycloneConfiguration, RefusesAFileWithoutAnEnd) {
  const tests::TemporaryFolder folder;
  const auto pipe = folder.path() / "pipe.xml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  const auto huge = folder.path() / "huge.xml";
  std::ofstream(huge).close();
  std::filesystem::resize_file(huge, std::uintmax_t{1} << 30U);
  const auto why = [](const std::string& file) -> std::string {
    try {
      return dds::cyclone_configuration({}, "<A/>,file://" + file);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  EXPECT_THAT(why(pipe),
              HasSubstr("CYCLONEDDS_URI names " + pipe.string() + ": it is not a regular file"));
  EXPECT_THAT(why("/dev/zero"), HasSubstr("/dev/zero: it is not a regular file"));
  EXPECT_THAT(why(huge), HasSubstr("it has more than 16 MiB"));
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

std::string reason(const dds::ParticipantOptions& options) {
  try {
    const dds::Participant sut(options);
    return "none";
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST(Participant, JoinsAndLeavesADomainAgainAndAgain) {
  const tests::Domain domain;
  for (int i = 0; i < 3; ++i) {
    const dds::Participant sut({.domain = domain.number()});
    EXPECT_GT(sut.handle(), 0);
  }
}

TEST(Participant, SharesADomainWithOthersOfItsProcess) {
  const tests::Domain domain;
  const dds::ParticipantOptions options{.domain = domain.number()};
  auto first = std::make_unique<dds::Participant>(options);
  const dds::Participant second(options);
  first.reset();
  EXPECT_EQ(reason(options), "none");
}

using boost::asio::ip::udp;

class PortsOfParticipants : public testing::Test {
 protected:
  /// Takes this pair's port for announcements, if it is free.
  bool take(std::uint32_t pair) {
    const auto port = static_cast<std::uint16_t>(7410 + 250 * domain.number() + 2 * pair);
    udp::socket socket(context, udp::v4());
    boost::system::error_code error;
    socket.bind({udp::v4(), port}, error);
    if (!error) {
      taken.push_back(std::move(socket));
    }
    return !error;
  }

  const tests::Domain domain;
  boost::asio::io_context context;
  std::vector<udp::socket> taken;
};

// Cyclone never forgets a port that it has found.
TEST_F(PortsOfParticipants, AreThoseOfAProcessThatHasLeft) {
  for (const auto finding : {dds::Finding::discovers, dds::Finding::announces}) {
    const dds::Participant sut({.domain = domain.number(), .finding = finding});
    EXPECT_FALSE(take(0));
    EXPECT_TRUE(take(1));
    taken.clear();
  }
  EXPECT_TRUE(take(0));
}

TEST_F(PortsOfParticipants, AreAnyOnAHostWithMoreProcesses) {
#ifdef __SANITIZE_ADDRESS__
  // Cyclone 0.10's rtps_init() loses 120 bytes, its multicast table, each time it finds no port.
  const __lsan::ScopedDisabler not_ours;
#endif
  for (std::uint32_t pair = 0; pair < dds::lowest_ports; ++pair) {
    take(pair);
  }
  EXPECT_EQ(reason({.domain = domain.number()}), "none");
  const std::string fixed = "<Discovery><ParticipantIndex>auto</ParticipantIndex></Discovery>";
  EXPECT_EQ(reason({.domain = domain.number(), .configuration = fixed}), "none")
      << "status and doctor join";
  const std::string why = reason(
      {.domain = domain.number(), .finding = dds::Finding::announces, .configuration = fixed});
  EXPECT_THAT(why, HasSubstr("processes_per_host"));
  EXPECT_THAT(why, HasSubstr("\n  Cyclone: "));
}

TEST(Participant, ReportsCyclonesReasonWhyItCannotJoin) {
  const tests::Domain domain;
  const std::string why =
      reason({.domain = domain.number(),
              .configuration = R"(<General><Interfaces><NetworkInterface name="no-such-lan"/>)"
                               R"(</Interfaces></General>)"});
  EXPECT_THAT(why, HasSubstr("cannot join DDS domain " + std::to_string(domain.number())));
  EXPECT_THAT(why, HasSubstr("no-such-lan"));
}

TEST(WhyNotJoined, NamesTheSettingAndHasALineForEachOfCyclones) {
  const std::string why =
      dds::why_not_joined(3, "Error", "one\ntwo\n", "<CycloneDDS><Domain>…</Domain></CycloneDDS>");
  EXPECT_THAT(why, HasSubstr("CYCLONEDDS_URI applies"));
  EXPECT_THAT(why, HasSubstr("\n  Cyclone: one\n  Cyclone: two"));
  EXPECT_THAT(dds::why_not_joined(3, "Error", "one", ""), Not(HasSubstr("CYCLONEDDS_URI")));
  EXPECT_THAT(dds::why_not_joined(3, "Error", "x: does not match an available interface.", ""),
              HasSubstr("correct `interface`"));
}

TEST(Participant, RefusesAMisspeltSetting) {
  const tests::Domain domain;
  EXPECT_THAT(reason({.domain = domain.number(), .configuration = "<Discofery/>"}),
              HasSubstr("Discofery"));
}

TEST(Participant, RefusesAFabricThatWouldBeAPattern) {
  EXPECT_THAT(reason({.fabric = "*"}), HasSubstr("'*' is not a fabric name"));
  EXPECT_THAT(reason({.fabric = "a/b"}), HasSubstr("not a fabric name"));
  EXPECT_THAT(reason({.fabric = ""}), HasSubstr("not a fabric name"));
}

}  // namespace
}  // namespace millrace::fabric

namespace millrace::fabric::dds {
namespace {

TEST(CycloneLog, CountsLinesThatDifferInNumbersAsTheSameFault) {
  EXPECT_EQ(kind_of_line("handshake with 110c0a1:1c1 failed (code: 200)"),
            kind_of_line("handshake with 8f00001:22 failed (code: 201)"));
  EXPECT_EQ(kind_of_line("code 0"), kind_of_line("code 9"));
  EXPECT_NE(kind_of_line("subject: /O=plant/CN=press"), kind_of_line("subject: /O=plant/CN=lathe"));
  // The neighbours of digits.
  EXPECT_NE(kind_of_line("a /"), kind_of_line("a :"));
}

TEST(CycloneLog, KnowsTheLinesAboutRejectedProcesses) {
  EXPECT_TRUE(
      is_rejection("fsm: Process handshake failed: Certificate not valid: error: "
                   "certificate revoked; subject: /O=pki/CN=square-root(code: 200)"));
  EXPECT_FALSE(is_rejection("failed to send to udp/239.255.0.1:7400"));
}

TEST(CycloneLog, AcceptsAnyLine) {
  EXPECT_EQ(kind_of_line(""), "");
  EXPECT_EQ(kind_of_line(" a  1"), kind_of_line(" a  2"));
}

}  // namespace
}  // namespace millrace::fabric::dds
