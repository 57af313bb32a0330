#include "fabric/dds/participant.hpp"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
