#include "fabric/participant_identity.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const ParticipantIdentity gateway{
    .name = "gateway-1", .roles = {"gateway"}, .machines = {"press_1", "press_2"}};

IdentityStatus status_of(ParticipantIdentity identity) {
  return {std::make_shared<const ParticipantIdentity>(std::move(identity))};
}

TEST(IdentityPartitions, DescribeAnIdentityAndAreParsedAgain) {
  const auto sut = identity_partitions("hall", gateway);
  EXPECT_THAT(sut, ElementsAre("hall/@name/gateway-1", "hall/@role/gateway",
                               "hall/@machine/press_1", "hall/@machine/press_2"));
  EXPECT_EQ(parse_participant_identity("hall", sut), gateway);
  EXPECT_EQ(parse_participant_identity("another", sut), std::nullopt);
}

TEST(IdentityPartitions, WithoutOneNameAreNoIdentity) {
  EXPECT_EQ(parse_participant_identity("hall", {}), std::nullopt);
  EXPECT_EQ(parse_participant_identity("hall", {"hall/@role/gateway"}), std::nullopt);
  EXPECT_EQ(parse_participant_identity("hall", {"hall/@name/"}), std::nullopt);
  EXPECT_EQ(parse_participant_identity("hall", {"hall/@name/a", "hall/@name/b"}), std::nullopt);
}

TEST(IdentityPartitions, AcceptNoPatterns) {
  EXPECT_EQ(parse_participant_identity("hall", {"hall/@name/*"}), std::nullopt);
  EXPECT_EQ(
      parse_participant_identity("hall", {"hall/@name/a", "hall/@machine/*", "hall/@machine/p?"}),
      ParticipantIdentity{.name = "a"});
}

TEST(Authorization, IsGrantedForTheMachinesOfTheCertificate) {
  const IdentityStatus sut = status_of(gateway);
  EXPECT_EQ(authorization_of(sut), Authorization::granted);
  EXPECT_EQ(authorization_of(sut, "press_1"), Authorization::granted);
  EXPECT_EQ(authorization_of(sut, "press_3"), Authorization::other_machine);
  EXPECT_THAT(denial_of(sut, Authorization::other_machine, "press_3"),
              HasSubstr("gateway-1 speaks for press_3, which its certificate does not name"));
}

TEST(Authorization, OfAMachineCoversItsQueues) {
  const IdentityStatus sut = status_of(gateway);
  EXPECT_EQ(authorization_of(sut, "press_1.ALARMS"), Authorization::granted);
  EXPECT_EQ(authorization_of(sut, "press_3.ALARMS"), Authorization::other_machine);
  EXPECT_EQ(authorization_of(sut, "press_10"), Authorization::other_machine);
}

TEST(Authorization, OfATesterCoversAnyMachineWhereTestersMayPublish) {
  const IdentityStatus sut = status_of({.name = "bench", .roles = {"tester"}});
  EXPECT_EQ(authorization_of(sut, "press_3", true), Authorization::granted);
  EXPECT_EQ(authorization_of(sut, "press_3", false), Authorization::other_machine);
}

TEST(Authorization, EndsWithTheCertificate) {
  IdentityStatus sut = status_of(gateway);
  sut.revoked = true;
  EXPECT_EQ(authorization_of(sut, "press_1"), Authorization::revoked);
  EXPECT_EQ(authorization_of({}, "press_1"), Authorization::unauthenticated);
}

TEST(Issuer, IsTheNameInTheCertificate) {
  EXPECT_EQ(issuer_of("", "anna@hall"), "anna@hall");
  EXPECT_EQ(issuer_of("office", "office (anna@hall)"), "office (anna@hall)");
  EXPECT_EQ(issuer_of("office", "chief (boss@desk)"), "office (chief (boss@desk))");
  EXPECT_LE(issuer_of(std::string(64, 'a'), std::string(255, 'b')).size(), 127U);
}

TEST(AnIdentity, NamesItsProcess) {
  const ProcessInfo where{.program = "archiver", .host = "hall-pc", .pid = 17};
  EXPECT_EQ(parse_process_info(format_process_info(where)), where);
  for (const char* other : {"", "17", "17\nhall-pc", "x\nhall-pc\narchiver", "-1\na\nb"}) {
    EXPECT_EQ(parse_process_info(other), std::nullopt) << other;
  }
}

}  // namespace
}  // namespace millrace::fabric
