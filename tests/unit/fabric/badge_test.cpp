#include "fabric/badge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

const Badge gateway{.name = "gateway-1", .roles = {"gateway"}, .machines = {"press_1", "press_2"}};

Proof proof_of(Badge badge) {
  return {std::make_shared<const Badge>(std::move(badge))};
}

TEST(BadgePartitions, SayWhoSomebodyIsAndAreReadAgain) {
  const auto sut = badge_partitions("hall", gateway);
  EXPECT_THAT(sut, ElementsAre("hall/@name/gateway-1", "hall/@role/gateway",
                               "hall/@machine/press_1", "hall/@machine/press_2"));
  EXPECT_EQ(parse_badge("hall", sut), gateway);
  EXPECT_EQ(parse_badge("another", sut), std::nullopt);
}

TEST(BadgePartitions, WithoutOneNameAreNoBadge) {
  EXPECT_EQ(parse_badge("hall", {}), std::nullopt);
  EXPECT_EQ(parse_badge("hall", {"hall/@role/gateway"}), std::nullopt);
  EXPECT_EQ(parse_badge("hall", {"hall/@name/"}), std::nullopt);
  EXPECT_EQ(parse_badge("hall", {"hall/@name/a", "hall/@name/b"}), std::nullopt);
}

TEST(BadgePartitions, ThatArePatternsShowNothing) {
  EXPECT_EQ(parse_badge("hall", {"hall/@name/*"}), std::nullopt);
  EXPECT_EQ(parse_badge("hall", {"hall/@name/a", "hall/@machine/*", "hall/@machine/p?"}),
            Badge{.name = "a"});
}

TEST(Standing, IsThatOfAMachineForWhoseCertificateNamesIt) {
  const Proof sut = proof_of(gateway);
  EXPECT_EQ(standing_of(sut), Standing::believed);
  EXPECT_EQ(standing_of(sut, "press_1"), Standing::believed);
  EXPECT_EQ(standing_of(sut, "press_3"), Standing::not_its_machine);
  EXPECT_THAT(doubt_of(sut, Standing::not_its_machine, "press_3"),
              HasSubstr("gateway-1 speaks for press_3, which its certificate does not name"));
}

TEST(Standing, OfAMachineIsThatOfItsQueues) {
  const Proof sut = proof_of(gateway);
  EXPECT_EQ(standing_of(sut, "press_1.ALARMS"), Standing::believed);
  EXPECT_EQ(standing_of(sut, "press_3.ALARMS"), Standing::not_its_machine);
  EXPECT_EQ(standing_of(sut, "press_10"), Standing::not_its_machine);
}

TEST(Standing, OfATesterIsThatOfAnyMachineWhereHeMaySpeak) {
  const Proof sut = proof_of({.name = "bench", .roles = {"tester"}});
  EXPECT_EQ(standing_of(sut, "press_3", true), Standing::believed);
  EXPECT_EQ(standing_of(sut, "press_3", false), Standing::not_its_machine);
}

TEST(Standing, EndsWithTheCertificate) {
  Proof sut = proof_of(gateway);
  sut.revoked = true;
  EXPECT_EQ(standing_of(sut, "press_1"), Standing::revoked);
  EXPECT_EQ(standing_of({}, "press_1"), Standing::unproven);
}

TEST(Issuer, IsWhoTheCertificateSays) {
  EXPECT_EQ(issuer_of("", "anna@hall"), "anna@hall");
  EXPECT_EQ(issuer_of("office", "office (anna@hall)"), "office (anna@hall)");
  EXPECT_EQ(issuer_of("office", "chief (boss@desk)"), "office (chief (boss@desk))");
  EXPECT_LE(issuer_of(std::string(64, 'a'), std::string(255, 'b')).size(), 127U);
}

TEST(ABadge, SaysWhichProcessShowsIt) {
  const Whereabouts where{.program = "archiver", .host = "hall-pc", .pid = 17};
  EXPECT_EQ(parse_whereabouts(format_whereabouts(where)), where);
  for (const char* other : {"", "17", "17\nhall-pc", "x\nhall-pc\narchiver", "-1\na\nb"}) {
    EXPECT_EQ(parse_whereabouts(other), std::nullopt) << other;
  }
}

}  // namespace
}  // namespace millrace::fabric
