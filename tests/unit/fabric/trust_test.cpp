#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/participant_identity.hpp"
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
const std::set<Role> every_role{Role::gateway, Role::service, Role::operating, Role::observer,
                                Role::tester};
const std::string own = "hall/560aacbf-6335-44a9-895a-8b27f3ed5e47";

Participant service() {
  return {.name = "root", .roles = {Role::service}, .uuids = {uuid}};
}

std::vector<Grant> of_access(Access way, const std::vector<Grant>& grants) {
  std::vector<Grant> chosen;
  std::ranges::copy_if(grants, std::back_inserter(chosen),
                       [&](const Grant& grant) { return grant.access == way; });
  return chosen;
}

TEST(Grants, OfAServiceCoverItsOwnUuidsAndItsOwnState) {
  EXPECT_THAT(
      grants_of(service(), "hall"),
      UnorderedElementsAre(Grant{Access::write, "millrace/v5/identity", "hall/@name/root"},
                           Grant{Access::write, "millrace/v5/identity", "hall/@role/service"},
                           Grant{Access::read, "millrace/v5/identity", "hall/@*"},
                           Grant{Access::write, "millrace/v5/reply", own},
                           Grant{Access::write, "millrace/v5/heartbeat", "hall"},
                           Grant{Access::write, "millrace/v5/outcome", "hall"},
                           Grant{Access::write, "millrace/v5/alarm", "hall"},
                           Grant{Access::read, "millrace/v5/request", own + "/*"},
                           Grant{Access::read, "millrace/v5/command", "hall"}));
}

TEST(Grants, OfAnObserverWriteOnlyItsIdentityAndItsAlarms) {
  const auto sut = grants_of({.name = "o", .roles = {Role::observer}}, "hall");
  EXPECT_THAT(
      of_access(Access::write, sut),
      UnorderedElementsAre(Grant{Access::write, "millrace/v5/identity", "hall/@name/o"},
                           Grant{Access::write, "millrace/v5/identity", "hall/@role/observer"},
                           Grant{Access::write, "millrace/v5/alarm", "hall"}));
  EXPECT_THAT(sut, Contains(Grant{Access::read, "millrace/v5/request", "hall/*"}));
  EXPECT_THAT(sut, Contains(Grant{Access::read, "millrace/v5/event", "hall"}));
}

TEST(Grants, LetAnObserverReadEachTopic) {
  std::set<std::string> topics;
  for (const Grant& grant :
       of_access(Access::read, grants_of({.name = "o", .roles = {Role::observer}}, "hall"))) {
    topics.insert(grant.topic);
  }
  Participant everybody{.name = "x", .roles = every_role, .uuids = {uuid}, .machines = {"m"}};
  for (const Grant& grant : of_access(Access::write, grants_of(everybody, "hall"))) {
    EXPECT_TRUE(topics.contains(grant.topic)) << grant.topic;
  }
}

TEST(Grants, OfAnOperatorAddOnlyCommandsAndVariableRequests) {
  EXPECT_THAT(
      of_access(Access::write, grants_of({.name = "o", .roles = {Role::operating}}, "hall")),
      UnorderedElementsAre(Grant{Access::write, "millrace/v5/identity", "hall/@name/o"},
                           Grant{Access::write, "millrace/v5/identity", "hall/@role/operator"},
                           Grant{Access::write, "millrace/v5/command", "hall"},
                           Grant{Access::write, "millrace/v5/variable/request", "hall"}));
}

TEST(Grants, OfATesterAllowRequestsButNoMachine) {
  EXPECT_THAT(of_access(Access::write, grants_of({.name = "t", .roles = {Role::tester}}, "hall")),
              AllOf(Contains(Grant{Access::write, "millrace/v5/request", "hall/*"}),
                    Contains(Grant{Access::write, "millrace/v5/data", "hall"}),
                    Not(Contains(Field(&Grant::topic, "millrace/v5/machine")))));
}

TEST(Grants, OfAGatewayAllowNeitherRepliesNorCommands) {
  const Participant participant{.name = "g", .roles = {Role::gateway}, .machines = {"press_1"}};
  EXPECT_THAT(of_access(Access::write, grants_of(participant, "hall")),
              AllOf(Contains(Field(&Grant::topic, "millrace/v5/machine")),
                    Not(Contains(Field(&Grant::topic, "millrace/v5/reply"))),
                    Not(Contains(Field(&Grant::topic, "millrace/v5/command")))));
}

TEST(Grants, OfAGatewayAllowTheIdentityOfItsMachinesOnly) {
  const Participant participant{
      .name = "g", .roles = {Role::gateway}, .machines = {"press_1", "a<b"}};
  const auto sut = grants_of(participant, "hall");
  EXPECT_THAT(sut,
              AllOf(Contains(Grant{Access::write, "millrace/v5/identity", "hall/@machine/press_1"}),
                    Contains(Grant{Access::write, "millrace/v5/identity", "hall/@machine/a<b"})));
  const auto shown = identity_partitions_in(permissions_document(sut, "CN=g", {}, {}));
  const auto identity = parse_participant_identity("hall", shown);
  ASSERT_TRUE(identity);
  EXPECT_EQ(*identity, (ParticipantIdentity{
                           .name = "g", .roles = {"gateway"}, .machines = {"press_1", "a<b"}}));
}

TEST(Grants, AreOfOneFabric) {
  for (const Role role : every_role) {
    const Participant participant{.name = "x", .roles = {role}, .uuids = {uuid}, .machines = {"m"}};
    EXPECT_THAT(grants_of(participant, "hall"), Each(Field(&Grant::partition, StartsWith("hall"))));
  }
}

TEST(Participant, NeedsTheUuidsOrMachinesOfItsRole) {
  EXPECT_FALSE(mistake_in(service()));
  EXPECT_THAT(*mistake_in({.name = "s", .roles = {Role::service}}), HasSubstr("UUIDs"));
  EXPECT_THAT(*mistake_in({.name = "g", .roles = {Role::gateway}}), HasSubstr("machines"));
  EXPECT_THAT(*mistake_in({.name = "o", .roles = {Role::observer}, .uuids = {uuid}}),
              HasSubstr("for the role service"));
  EXPECT_THAT(*mistake_in({.name = "o"}), HasSubstr("no role"));
}

TEST(Participant, HasANameThatIsOneOfAFolderToo) {
  for (const char* name : {"", ".", "..", "../x", "a/b", "a b", "-x", ".hidden", "a\nb"}) {
    EXPECT_FALSE(is_participant_name(name)) << name;
  }
  EXPECT_FALSE(is_participant_name(std::string(65, 'a')));
  EXPECT_TRUE(is_participant_name("gateway-1.hall_3"));
}

// Characters that make a partition or a permission a pattern.
TEST(Participant, MayAnswerNoPatternOfUuids) {
  // A slash: a participant that may answer "a" may read the partitions of "a/b".
  for (const char* pattern :
       {"*", "560a*", "?", "[a]", "a\\b", "a,b", "", "a\nb", "a/b", "\xc3\xa4"}) {
    EXPECT_TRUE(mistake_in({.name = "s", .roles = {Role::service}, .uuids = {pattern}})) << pattern;
  }
}

TEST(Participant, ServesOnlyMachinesThatAGatewayCanHave) {
  for (const char* name : {"press/*", "press 1",
                           "pr\xc3\xbc"
                           "f",
                           "", "a.b", "press_1 "}) {
    EXPECT_TRUE(mistake_in({.name = "g", .roles = {Role::gateway}, .machines = {name}})) << name;
  }
  EXPECT_FALSE(mistake_in({.name = "g", .roles = {Role::gateway}, .machines = {"press_1-B"}}));
}

TEST(Permissions, AllowWhatIsGrantedAndDenyTheRest) {
  const std::string sut =
      permissions_document({{Access::write, "a<b", "hall/x"}}, "CN=\"x\",O=plant",
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
  const std::string sut = permissions_document({{Access::write, "identity", "hall/@name/g"},
                                                {Access::write, "identity", "hall/@role/gateway"},
                                                {Access::write, "heartbeat", "hall"},
                                                {Access::write, "alarm", "hall"}},
                                               "CN=g", {}, {});
  const auto first = sut.find("<publish>");
  const std::string rule = sut.substr(first, sut.find("</publish>") - first);
  EXPECT_THAT(sut, HasSubstr("hall/@role/gateway"));
  const bool identity_first = rule.find("@name") != std::string::npos;
  EXPECT_EQ(rule.find("@role") != std::string::npos, identity_first);
  EXPECT_EQ(rule.find("<topic>heartbeat</topic>") != std::string::npos, !identity_first);
  EXPECT_EQ(rule.find("<topic>alarm</topic>") != std::string::npos, !identity_first);
}

TEST(Permissions, OfAnEarlierVersionHaveNoIdentity) {
  EXPECT_THAT(identity_partitions_in(permissions_document(
                  {{Access::write, "millrace/v5/reply", "hall/x"}}, "CN=g", {}, {})),
              testing::IsEmpty());
  EXPECT_THAT(identity_partitions_in("<publish><topic>millrace/v5/identity</topic><partition>"),
              testing::IsEmpty());
}

TEST(Permissions, AreOfOneCertificateAndOfItsTime) {
  const std::chrono::sys_seconds from{0s};
  const std::chrono::sys_seconds until{86'400s};
  const std::string sut = permissions_document({}, "CN=\"x\" & y,O=plant", from, until);
  EXPECT_EQ(mismatch_in(sut, "CN=\"x\" & y,O=plant", from, until), std::nullopt);
  EXPECT_THAT(mismatch_in(sut, "CN=z,O=plant", from, until).value_or(""),
              AllOf(HasSubstr("is made for CN=\"x\" & y,O=plant"), HasSubstr("CN=z")));
  EXPECT_THAT(mismatch_in(sut, "CN=\"x\" & y,O=plant", from, until + 1s).value_or(""),
              AllOf(HasSubstr("to 1970-01-02T00:00:00Z"), HasSubstr("to 1970-01-02T00:00:01Z")));
  for (const char* nonsense : {"", "<subject_name>CN=z,O=plant", "</subject_name><subject_name>"}) {
    EXPECT_TRUE(mismatch_in(nonsense, "CN=z,O=plant", from, until)) << nonsense;
  }
}

TEST(Governance, IsRecognisedWhenItHasBeenSigned) {
  std::string signed_one;
  for (const char c : governance_document(Protection::sign)) {
    signed_one += c == '\n' ? "\r\n" : std::string(1, c);
  }
  EXPECT_TRUE(is_governance(signed_one, Protection::sign));
  EXPECT_FALSE(is_governance(signed_one, Protection::encrypt));
  const auto strict = signed_one.find("false");
  EXPECT_FALSE(is_governance(signed_one.replace(strict, 5, "true"), Protection::sign));
}

TEST(Governance, AllowsNoUnauthenticatedParticipants) {
  for (const Protection protection : {Protection::sign, Protection::encrypt}) {
    EXPECT_THAT(governance_document(protection),
                AllOf(HasSubstr("<allow_unauthenticated_participants>false<"),
                      HasSubstr("<enable_read_access_control>true<"),
                      HasSubstr("<enable_write_access_control>true<"),
                      HasSubstr(std::string("<rtps_protection_kind>") +
                                std::string(name_of(protection)) + "<")));
  }
}

}  // namespace
}  // namespace millrace::fabric::trust
