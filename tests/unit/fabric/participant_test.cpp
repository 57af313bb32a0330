#include "fabric/dds/participant.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/udp.hpp>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/dds/configuration.hpp"
#include "tests/support/domain.hpp"

namespace millrace::fabric {
namespace {

using testing::HasSubstr;

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
  for (std::uint32_t pair = 0; pair < dds::lowest_ports; ++pair) {
    take(pair);
  }
  EXPECT_EQ(reason({.domain = domain.number()}), "none");
  EXPECT_THAT(reason({.domain = domain.number(),
                      .configuration = "<Discovery><ParticipantIndex>auto</ParticipantIndex>"
                                       "</Discovery>"}),
              HasSubstr("participant index"));
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
