#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/badge.hpp"
#include "fabric/trust/governance.hpp"
#include "fabric/trust/grants.hpp"
#include "fabric/trust/permissions.hpp"

namespace millrace::fabric::trust {
namespace {

using namespace std::chrono_literals;
using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::Field;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using testing::UnorderedElementsAre;

const std::string uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47";
const std::string own = "hall/560aacbf-6335-44a9-895a-8b27f3ed5e47";

Member service() {
  return {.name = "root", .roles = {Role::service}, .uuids = {uuid}};
}

std::vector<Grant> of_way(Way way, const std::vector<Grant>& grants) {
  std::vector<Grant> chosen;
  std::ranges::copy_if(grants, std::back_inserter(chosen),
                       [&](const Grant& grant) { return grant.way == way; });
  return chosen;
}

TEST(Grants, OfAServiceAreItsOwnUuidsAndWhatItSaysOfItself) {
  EXPECT_THAT(grants_of(service(), "hall"),
              UnorderedElementsAre(Grant{Way::write, "millrace/badge", "hall/@name/root"},
                                   Grant{Way::write, "millrace/badge", "hall/@role/service"},
                                   Grant{Way::read, "millrace/badge", "hall/@*"},
                                   Grant{Way::write, "millrace/v3/reply", own},
                                   Grant{Way::write, "millrace/v3/beat", "hall"},
                                   Grant{Way::write, "millrace/outcome", "hall"},
                                   Grant{Way::write, "millrace/notice", "hall"},
                                   Grant{Way::read, "millrace/v3/request", own + "/*"},
                                   Grant{Way::read, "millrace/command", "hall"}));
}

TEST(Grants, OfAnObserverWriteNothingButWhatTroublesItself) {
  const auto sut = grants_of({.name = "o", .roles = {Role::observer}}, "hall");
  EXPECT_THAT(of_way(Way::write, sut),
              UnorderedElementsAre(Grant{Way::write, "millrace/badge", "hall/@name/o"},
                                   Grant{Way::write, "millrace/badge", "hall/@role/observer"},
                                   Grant{Way::write, "millrace/notice", "hall"}));
  EXPECT_THAT(sut, Contains(Grant{Way::read, "millrace/v3/request", "hall/*"}));
  EXPECT_THAT(sut, Contains(Grant{Way::read, "millrace/event", "hall"}));
}

TEST(Grants, LetWhoSeesEverythingReadEachTopicThatThereIs) {
  std::set<std::string> topics;
  for (const Grant& grant :
       of_way(Way::read, grants_of({.name = "o", .roles = {Role::observer}}, "hall"))) {
    topics.insert(grant.topic);
  }
  Member everybody{.name = "x",
                   .roles = {all_roles().begin(), all_roles().end()},
                   .uuids = {uuid},
                   .machines = {"m"}};
  for (const Grant& grant : of_way(Way::write, grants_of(everybody, "hall"))) {
    EXPECT_TRUE(topics.contains(grant.topic)) << grant.topic;
  }
}

TEST(Grants, OfAnOperatorAddCommandsAndQuestionsAboutVariablesAndNothingElse) {
  EXPECT_THAT(of_way(Way::write, grants_of({.name = "o", .roles = {Role::operating}}, "hall")),
              UnorderedElementsAre(Grant{Way::write, "millrace/badge", "hall/@name/o"},
                                   Grant{Way::write, "millrace/badge", "hall/@role/operator"},
                                   Grant{Way::write, "millrace/command", "hall"},
                                   Grant{Way::write, "millrace/variable/request", "hall"}));
}

TEST(Grants, OfATesterLetHimAskAndClaimNoMachine) {
  EXPECT_THAT(of_way(Way::write, grants_of({.name = "t", .roles = {Role::tester}}, "hall")),
              AllOf(Contains(Grant{Way::write, "millrace/v3/request", "hall/*"}),
                    Contains(Grant{Way::write, "millrace/data", "hall"}),
                    Not(Contains(Field(&Grant::topic, "millrace/machine")))));
}

TEST(Grants, OfAGatewayLetItAnswerNoCallsAndCommandNothing) {
  const Member member{.name = "g", .roles = {Role::gateway}, .machines = {"press_1"}};
  EXPECT_THAT(of_way(Way::write, grants_of(member, "hall")),
              AllOf(Contains(Field(&Grant::topic, "millrace/machine")),
                    Not(Contains(Field(&Grant::topic, "millrace/v3/reply"))),
                    Not(Contains(Field(&Grant::topic, "millrace/command")))));
}

TEST(Grants, OfAGatewayLetItShowTheBadgeOfItsMachinesAndNoOthers) {
  const Member member{.name = "g", .roles = {Role::gateway}, .machines = {"press_1", "a<b"}};
  const auto sut = grants_of(member, "hall");
  EXPECT_THAT(sut, AllOf(Contains(Grant{Way::write, "millrace/badge", "hall/@machine/press_1"}),
                         Contains(Grant{Way::write, "millrace/badge", "hall/@machine/a<b"})));
  const auto shown = badge_in(permissions_document(sut, "CN=g", {}, {}));
  const auto badge = parse_badge("hall", shown);
  ASSERT_TRUE(badge);
  EXPECT_EQ(*badge, (Badge{.name = "g", .roles = {"gateway"}, .machines = {"press_1", "a<b"}}));
}

TEST(Grants, AreOfOneFabric) {
  for (const Role role : all_roles()) {
    const Member member{.name = "x", .roles = {role}, .uuids = {uuid}, .machines = {"m"}};
    EXPECT_THAT(grants_of(member, "hall"), Each(Field(&Grant::partition, StartsWith("hall"))));
  }
}

TEST(Member, NeedsWhatItsRoleIsAbout) {
  EXPECT_FALSE(mistake_in(service()));
  EXPECT_THAT(*mistake_in({.name = "s", .roles = {Role::service}}), HasSubstr("UUIDs"));
  EXPECT_THAT(*mistake_in({.name = "g", .roles = {Role::gateway}}), HasSubstr("machines"));
  EXPECT_THAT(*mistake_in({.name = "o", .roles = {Role::observer}, .uuids = {uuid}}),
              HasSubstr("for the role service"));
  EXPECT_THAT(*mistake_in({.name = "o"}), HasSubstr("no role"));
}

TEST(Member, HasANameThatIsOneOfAFolderToo) {
  for (const char* name : {"", ".", "..", "../x", "a/b", "a b", "-x", ".hidden", "a\nb"}) {
    EXPECT_FALSE(is_member_name(name)) << name;
  }
  EXPECT_FALSE(is_member_name(std::string(65, 'a')));
  EXPECT_TRUE(is_member_name("gateway-1.hall_3"));
}

// What a partition or a permission would take for a pattern.
TEST(Member, MayAnswerNoPatternOfUuids) {
  // A slash: who may answer "a" may read what is in the mailboxes of "a/b".
  for (const char* pattern :
       {"*", "560a*", "?", "[a]", "a\\b", "a,b", "", "a\nb", "a/b", "\xc3\xa4"}) {
    EXPECT_TRUE(mistake_in({.name = "s", .roles = {Role::service}, .uuids = {pattern}})) << pattern;
  }
}

TEST(Member, SpeaksForMachinesThatAGatewayCanHave) {
  for (const char* name : {"press/*", "press 1",
                           "pr\xc3\xbc"
                           "f",
                           "", "a.b", "press_1 "}) {
    EXPECT_TRUE(mistake_in({.name = "g", .roles = {Role::gateway}, .machines = {name}})) << name;
  }
  EXPECT_FALSE(mistake_in({.name = "g", .roles = {Role::gateway}, .machines = {"press_1-B"}}));
}

TEST(Permissions, SayWhatIsGrantedAndDenyTheRest) {
  const std::string sut =
      permissions_document({{Way::write, "a<b", "hall/x"}}, "CN=\"x\",O=plant",
                           std::chrono::sys_seconds{0s}, std::chrono::sys_seconds{86'400s});
  EXPECT_THAT(sut, HasSubstr("<subject_name>CN=&quot;x&quot;,O=plant</subject_name>"));
  EXPECT_THAT(sut, HasSubstr("<not_before>1970-01-01T00:00:00Z</not_before>"));
  EXPECT_THAT(sut, HasSubstr("<not_after>1970-01-02T00:00:00Z</not_after>"));
  EXPECT_THAT(sut, HasSubstr("<topic>a&lt;b</topic>"));
  EXPECT_THAT(sut, HasSubstr("<partition>hall/x</partition>"));
  EXPECT_THAT(sut, HasSubstr("<default>DENY</default>"));
  EXPECT_THAT(sut, Not(HasSubstr("subscribe")));
}

// Cyclone allows an endpoint if one rule has all its partitions.
TEST(Permissions, NameAllPartitionsOfATopicInOneRule) {
  const std::string sut = permissions_document({{Way::write, "badge", "hall/@name/g"},
                                                {Way::write, "badge", "hall/@role/gateway"},
                                                {Way::write, "beat", "hall"},
                                                {Way::write, "notice", "hall"}},
                                               "CN=g", {}, {});
  const auto first = sut.find("<publish>");
  const std::string rule = sut.substr(first, sut.find("</publish>") - first);
  EXPECT_THAT(sut, HasSubstr("hall/@role/gateway"));
  const bool badge_first = rule.find("@name") != std::string::npos;
  EXPECT_EQ(rule.find("@role") != std::string::npos, badge_first);
  EXPECT_EQ(rule.find("<topic>beat</topic>") != std::string::npos, !badge_first);
  EXPECT_EQ(rule.find("<topic>notice</topic>") != std::string::npos, !badge_first);
}

TEST(Permissions, OfAnEarlierVersionSayNothingOfABadge) {
  EXPECT_THAT(
      badge_in(permissions_document({{Way::write, "millrace/v3/reply", "hall/x"}}, "CN=g", {}, {})),
      testing::IsEmpty());
  EXPECT_THAT(badge_in("<publish><topic>millrace/badge</topic><partition>"), testing::IsEmpty());
}

TEST(Permissions, AreOfOneCertificateAndOfItsTime) {
  const std::chrono::sys_seconds from{0s};
  const std::chrono::sys_seconds until{86'400s};
  const std::string sut = permissions_document({}, "CN=\"x\" & y,O=plant", from, until);
  EXPECT_EQ(mismatch_in(sut, "CN=\"x\" & y,O=plant", from, until), std::nullopt);
  EXPECT_THAT(mismatch_in(sut, "CN=z,O=plant", from, until).value_or(""),
              AllOf(HasSubstr("is about CN=\"x\" & y,O=plant"), HasSubstr("CN=z")));
  EXPECT_THAT(mismatch_in(sut, "CN=\"x\" & y,O=plant", from, until + 1s).value_or(""),
              AllOf(HasSubstr("to 1970-01-02T00:00:00Z"), HasSubstr("to 1970-01-02T00:00:01Z")));
  for (const char* nonsense : {"", "<subject_name>CN=z,O=plant", "</subject_name><subject_name>"}) {
    EXPECT_TRUE(mismatch_in(nonsense, "CN=z,O=plant", from, until)) << nonsense;
  }
}

TEST(Governance, IsKnownAgainWhenItHasBeenSigned) {
  std::string signed_one;
  for (const char c : governance_document(Protection::sign)) {
    signed_one += c == '\n' ? "\r\n" : std::string(1, c);
  }
  EXPECT_TRUE(is_governance(signed_one, Protection::sign));
  EXPECT_FALSE(is_governance(signed_one, Protection::encrypt));
  const auto strict = signed_one.find("false");
  EXPECT_FALSE(is_governance(signed_one.replace(strict, 5, "true"), Protection::sign));
}

TEST(Governance, TakesNobodyWhoShowsNothing) {
  for (const Protection protection : {Protection::sign, Protection::encrypt}) {
    EXPECT_THAT(governance_document(protection),
                AllOf(HasSubstr("<allow_unauthenticated_participants>false<"),
                      HasSubstr("<enable_read_access_control>true<"),
                      HasSubstr("<enable_write_access_control>true<"),
                      HasSubstr(std::string("<rtps_protection_kind>") +
                                std::string(name_of(protection)) + "<")));
    EXPECT_EQ(protection_named(name_of(protection)), protection);
  }
}

}  // namespace
}  // namespace millrace::fabric::trust
