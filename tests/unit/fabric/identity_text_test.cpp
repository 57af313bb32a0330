#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/channel_scope.hpp"
#include "fabric/participant_identity.hpp"
#include "fabric/registry/identity.hpp"
#include "tests/support/data.hpp"

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
  const ProcessInfo where{.program = "archiver",
                          .host = "hall-pc",
                          .pid = 17,
                          .version = {.version = "1.0.0", .lowest_wire = 5, .highest_wire = 6}};
  EXPECT_EQ(parse_process_info(format_process_info(where)), where);
  const ProcessInfo of_another_make{.program = "archiver", .host = "hall-pc", .pid = 17};
  EXPECT_EQ(parse_process_info("17\nhall-pc\narchiver"), of_another_make);
  for (const char* other : {"", "17", "17\nhall-pc", "x\nhall-pc\narchiver", "-1\na\nb"}) {
    EXPECT_EQ(parse_process_info(other), std::nullopt) << other;
  }
}

TEST(TheVersionOfAProcess, IsReadWithLinesOfALaterVersion) {
  const ProcessVersion sut{.version = "1.2.0", .lowest_wire = 5, .highest_wire = 6};
  EXPECT_EQ(parse_process_version(format_process_version(sut)), sut);
  EXPECT_EQ(parse_process_version(format_process_version(sut) + "later=x\nlater\n"), sut);
}

TEST(TheVersionOfAProcess, IsUnknownWithoutARangeOfWireVersions) {
  for (const char* other :
       {"", "lowest_wire=5\nhighest_wire=6\n", "millrace-process 1\nlowest_wire=5\n",
        "millrace-process 1\nlowest_wire=6\nhighest_wire=5\n",
        "millrace-process 1\nlowest_wire=0\nhighest_wire=5\n",
        "millrace-process 1\nlowest_wire=x\nhighest_wire=5\n"}) {
    EXPECT_EQ(parse_process_version(other), std::nullopt) << other;
  }
  const std::string flood = "millrace-process 1\nversion=" + std::string(60'000, 'x') +
                            "\nlowest_wire=5\nhighest_wire=5\n";
  EXPECT_LE(parse_process_version(flood).value().version.size(), 64U);
}

TEST(TheVersionOfAProcess, IsTooOldForOneWhoseWireVersionsAreAllLater) {
  const ProcessVersion five{.lowest_wire = 5, .highest_wire = 5};
  const ProcessVersion both{.lowest_wire = 5, .highest_wire = 6};
  const ProcessVersion six{.lowest_wire = 6, .highest_wire = 6};
  EXPECT_TRUE(is_too_old_for(five, six));
  EXPECT_FALSE(is_too_old_for(six, five));
  EXPECT_FALSE(is_too_old_for(five, both));
  EXPECT_FALSE(is_too_old_for(both, six));
  EXPECT_FALSE(is_too_old_for({}, six));
  EXPECT_FALSE(is_too_old_for(five, {}));
}

TEST(TheVersionOfAProcess, IsInTheNamesOfItsTopics) {
  EXPECT_EQ(wire_version_of("millrace/v12/request"), 12U);
  EXPECT_EQ(wire_version_of("millrace/request"), 1U);
  EXPECT_EQ(wire_version_of("millrace/vx/request"), std::nullopt);
  EXPECT_EQ(wire_version_of("other"), std::nullopt);
  EXPECT_EQ(wire_version_of(identity_topic_name), highest_wire_version);
}

std::string read(const std::string& name) {
  std::ifstream in(tests::test_data("corpus/identity") / name);
  return {std::istreambuf_iterator<char>(in), {}};
}

InstanceIdentity least() {
  return {.id = InstanceId::random(), .uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47"};
}

TEST(IdentityText, IsReadCompletely) {
  const auto sut = registry::parse_identity(read("complete"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->id.to_string(), "8d0c4e6a-52f3-4f0e-9d1b-0a4a2f7c9b11");
  EXPECT_EQ(sut->uuid, "560aacbf-6335-44a9-895a-8b27f3ed5e47");
  EXPECT_EQ(sut->description, "50% off\n");
  EXPECT_EQ(sut->host, "mill-7");
  EXPECT_EQ(sut->pid, 4711U);
  EXPECT_THAT(sut->channels,
              ElementsAre(ChannelScope{"cnc", 1}, ChannelScope{"press", 0}, ChannelScope{"", 2}));
  EXPECT_EQ(sut->delivery, Delivery::at_most_once);
  EXPECT_EQ(sut->concurrency, 4U);
  EXPECT_FALSE(sut->draining);
}

TEST(IdentityText, ReadsWhatItWrites) {
  InstanceIdentity sut = least();
  sut.name = "müller=\x01%\n";
  sut.channels = {{"cnc", 1}, {"", 0}};
  sut.draining = true;
  sut.completion_signal = CompletionSignal::response;
  EXPECT_EQ(registry::parse_identity(registry::format_identity(sut)), sut);
}

TEST(IdentityText, SkipsKeysOfLaterVersions) {
  EXPECT_TRUE(registry::parse_identity(read("least")));
}

TEST(IdentityText, ContainsNoCertificate) {
  InstanceIdentity sut = least();
  const std::string announced = registry::format_identity(sut);
  sut.certificate = "office";
  EXPECT_EQ(registry::format_identity(sut), announced);
  for (const char* line : {"=office\n", "certificate=office\n"}) {
    EXPECT_EQ(registry::parse_identity(announced + line)->certificate, "") << line;
  }
}

TEST(IdentityText, NamesTheWrongLine) {
  EXPECT_EQ(registry::parse_identity("hello").error(), "line 1: expected 'millrace-instance 2'");
  EXPECT_EQ(registry::parse_identity(read("cut_escape")).error(),
            "line 2: expected two hexadecimal digits after '%'");
  EXPECT_THAT(registry::parse_identity(read("bad_channel")).error(),
              HasSubstr("line 2: 'cnc/70000'"));
  EXPECT_EQ(registry::parse_identity("millrace-instance 2\npid=x").error(),
            "line 2: expected a number");
  EXPECT_EQ(registry::parse_identity("millrace-instance 2\nname").error(),
            "line 2: expected KEY=VALUE");
}

TEST(IdentityText, NamesTheInstanceOfAReplyWriter) {
  const InstanceId sut = InstanceId::random();
  EXPECT_EQ(registry::parse_instance(registry::format_instance(sut)), sut);
  EXPECT_FALSE(registry::parse_instance("instance=?"));
  EXPECT_FALSE(registry::parse_instance(sut.to_string()));
}

TEST(CheckIdentity, AcceptsTheLeast) {
  EXPECT_EQ(registry::check_identity(least()), std::nullopt);
}

TEST(CheckIdentity, RefusesWhatCannotBeAnnounced) {
  const auto with = [](auto change) {
    InstanceIdentity identity = least();
    change(identity);
    return registry::check_identity(identity).has_value();
  };
  EXPECT_TRUE(with([](auto& sut) { sut.id = {}; }));
  EXPECT_TRUE(with([](auto& sut) { sut.uuid = ""; }));
  EXPECT_TRUE(with([](auto& sut) { sut.uuid = "a*"; }));
  EXPECT_TRUE(with([](auto& sut) { sut.uuid = "what?"; }));
  EXPECT_TRUE(with([](auto& sut) { sut.uuid = " blank"; }));
  EXPECT_TRUE(with([](auto& sut) { sut.uuid = std::string(128, 'x'); }));
  EXPECT_TRUE(with([](auto& sut) { sut.description = std::string(256, 'x'); }));
  EXPECT_TRUE(with([](auto& sut) { sut.channels.assign(65, {}); }));
  EXPECT_TRUE(with([](auto& sut) { sut.concurrency = 0; }));
}

TEST(ChannelScopeText, ReadsMachineAndChannelOrWildcards) {
  for (const std::string text :
       {"cnc/1", "cnc/*", "*/65535", "*/*", "mill_7-b/3", "press.alarms/1"}) {
    const auto sut = parse_channel_scope(text);
    ASSERT_TRUE(sut) << sut.error();
    EXPECT_EQ(format_channel_scope(*sut), text);
  }
}

TEST(ChannelScopeText, RefusesEverythingElse) {
  for (const std::string text :
       {"", "cnc", "cnc/", "/1", "cnc/0", "cnc/65536", "cnc/1x", "c nc/1", "cnc/1/2", "cnc*/1",
        "press./1", ".alarms/1", "press.alarms.x/1"}) {
    EXPECT_FALSE(parse_channel_scope(text)) << text;
  }
}

}  // namespace
}  // namespace millrace::fabric
