// The bridge's decisions about LCM processes: which are present, and which are accepted.
#include "tests/unit/services/lcm/bridge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "services/lcm/config.hpp"
#include "tests/support/data.hpp"
#include "tests/support/expected_mistakes.hpp"

namespace millrace::services::lcm {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using tests::program;
using tests::uuid;

TEST_F(BridgeTest, RegistersAProgramThatAnnouncesItself) {
  const Actions actions = present();
  EXPECT_EQ(only<Register>(actions).announcement.uuid, uuid);
  EXPECT_EQ(only<Register>(actions).announcement.name, "press");
  EXPECT_THAT(log_of(actions), HasSubstr("at 127.0.0.1:4000 is there: press"));
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
}

TEST_F(BridgeTest, RegistersNothingOnItsOwn) {
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
}

TEST_F(BridgeTest, IgnoresTheChannelsOfOthers) {
  EXPECT_THAT(sut->on_message("CAMERA", "pixels", there, now), IsEmpty());
  EXPECT_THAT(sut->on_message("MILLRACE_REQUEST." + uuid, "ours", there, now), IsEmpty());
  EXPECT_THAT(sut->on_fragment("CAMERA", there, now.steady), IsEmpty());
}

TEST_F(BridgeTest, RegistersTwoProgramsOfOneUuidSeparately) {
  const Registration first = only<Register>(present()).number;
  presence_t other = tests::presence(microseconds());
  other.program = 43;
  const Registration second = only<Register>(present(other, elsewhere)).number;
  EXPECT_NE(first, second);
  EXPECT_EQ(requests(sut->on_call(second, request(1), now.steady)).at(0).program, 43);
  EXPECT_EQ(requests(sut->on_call(first, request(2), now.steady)).at(0).program, 42);
}

TEST_F(BridgeWithProgram, UnregistersASilentProgram) {
  give(1);
  EXPECT_THAT(pass_in_ticks(rules.silence), IsEmpty());
  const Actions actions = pass_in_ticks(1ms);
  EXPECT_EQ(only<Unregister>(actions).number, registration);
  EXPECT_THAT(log_of(actions), HasSubstr("is gone: silent for 1000 ms; 1 of its calls go to"));
  // No response to the NC program: the call moves on.
  EXPECT_THAT(all<Answer>(actions), IsEmpty());
  EXPECT_THAT(give(2), IsEmpty());
  EXPECT_EQ(sut->programs(), 0U);
}

TEST_F(BridgeWithProgram, RegistersAProgramAgainThatReturns) {
  pass_in_ticks(rules.silence + 1ms);
  EXPECT_GT(only<Register>(present()).number, registration);
}

TEST_F(BridgeWithProgram, UnregistersNoProgramAfterItsOwnStandstill) {
  pass_in_ticks(200ms);
  pass(10s);
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
  EXPECT_THAT(pass_in_ticks(rules.silence - 200ms), IsEmpty());
  EXPECT_THAT(all<Unregister>(pass_in_ticks(1ms)), SizeIs(1));
}

TEST_F(BridgeWithProgram, IgnoresAnotherProgramWithTheSameNumber) {
  const Actions actions = present(tests::presence(microseconds()), elsewhere);
  EXPECT_THAT(all<Register>(actions), IsEmpty());
  EXPECT_THAT(log_of(actions), HasSubstr("is at 127.0.0.1:4000 and also at 127.0.0.1:4001"));
  // It does not keep the first one alive either.
  pass_in_ticks(rules.silence);
  present(tests::presence(microseconds()), elsewhere);
  EXPECT_EQ(only<Unregister>(pass_in_ticks(1ms)).number, registration);
}

TEST_F(BridgeTest, IgnoresPresenceMessagesOfALog) {
  const Actions actions = present(tests::presence(microseconds() - 3'600'000'000), there);
  EXPECT_THAT(all<Register>(actions), IsEmpty());
  EXPECT_THAT(log_of(actions),
              HasSubstr("3600000 ms before this host's: the clocks differ, or a log is played"));
  EXPECT_THAT(log_of(present(tests::presence(microseconds() + 1'001'000), elsewhere)), IsEmpty());
}

TEST_F(BridgeTest, ServesOnlyNamedUuidsIfConfigured) {
  rules.any_uuid = false;
  rules.services["other"] = {};
  sut = std::make_unique<Bridge>(rules);
  EXPECT_THAT(log_of(present()), HasSubstr("which the configuration does not name"));
  presence_t named = tests::presence(microseconds());
  named.uuid = "other";
  EXPECT_EQ(only<Register>(present(named, there)).announcement.uuid, "other");
}

TEST_F(BridgeTest, FollowsTheRulesOfAUuidWhateverAProgramAnnounces) {
  rules.services[uuid] = {.channels = {{"cnc", 1}},
                          .delivery = fabric::Delivery::at_most_once,
                          .concurrency = 4,
                          .encoding = Encoding::cp1252};
  sut = std::make_unique<Bridge>(rules);
  const auto registered = only<Register>(present());
  EXPECT_EQ(registered.announcement.channels, rules.services[uuid].channels);
  EXPECT_EQ(registered.announcement.delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(registered.announcement.concurrency, 4U);
  registration = registered.number;
  EXPECT_EQ(requests(give(1)).at(0).text, "Ma\xDF");
}

TEST_F(BridgeTest, LimitsTheNumberOfPrograms) {
  for (std::int64_t number = 1; number <= 20'000; ++number) {
    presence_t message = tests::presence(microseconds());
    message.program = number;
    const Actions actions = present(message, there);
    if (number == 65) {
      EXPECT_THAT(log_of(actions), HasSubstr("64 programs are served, the limit"));
    } else if (number > 65) {
      ASSERT_THAT(actions, IsEmpty());
    }
  }
  EXPECT_EQ(sut->programs(), 64U);
}

TEST_F(BridgeTest, ServesWhatIsNoUuidOnlyIfTheConfigurationNamesIt) {
  rules.services["press"] = {};
  sut = std::make_unique<Bridge>(rules);
  presence_t message = tests::presence(microseconds());
  message.uuid = "nonsense";
  const Actions refused = present(message, there);
  EXPECT_THAT(all<Register>(refused), IsEmpty());
  EXPECT_THAT(log_of(refused), HasSubstr("announces 'nonsense', which is not a UUID"));
  message.uuid = "press";
  EXPECT_THAT(all<Register>(present(message, there)), SizeIs(1));
}

TEST_F(BridgeTest, KeepsRoomForTheProgramsThatTheConfigurationNames) {
  rules.services["press"] = {};
  sut = std::make_unique<Bridge>(rules);
  presence_t message = tests::presence(microseconds());
  for (message.program = 1; message.program <= 65; ++message.program) {
    present(message, there);
  }
  message.uuid = "press";
  EXPECT_THAT(all<Register>(present(message, there)), SizeIs(1));
  EXPECT_EQ(sut->programs(), 65U);
}

TEST_F(BridgeWithProgram, DrainsAProgramOnItsOwnRequest) {
  give(17);
  draining = true;
  EXPECT_EQ(only<Drain>(present({name(17)})).number, registration);
  pass(200ms);
  EXPECT_THAT(present({name(17)}), IsEmpty());
  EXPECT_THAT(all<Answer>(answer(tests::reply(name(17), "yes"))), SizeIs(1));
  EXPECT_EQ(only<Unregister>(sut->on_drained(registration)).number, registration);
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
  draining = false;
  pass(1s);
  EXPECT_THAT(all<Register>(present()), SizeIs(1));
}

TEST_F(BridgeWithProgram, RepeatsADrainUntilTheProgramLeaves) {
  EXPECT_EQ(drains(sut->on_dismissed(registration, now.steady)).at(0).program, program);
  EXPECT_THAT(sut->on_dismissed(registration, now.steady), IsEmpty());
  pass(200ms);
  EXPECT_THAT(drains(present()), SizeIs(1));
  sut->on_drained(registration);
  pass(200ms);
  const Actions still_there = present();
  EXPECT_THAT(drains(still_there), SizeIs(1));
  EXPECT_THAT(all<Register>(still_there), IsEmpty());
  draining = true;
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
}

TEST_F(BridgeWithProgram, RegistersAChangedProgramAgainOnceItIsIdle) {
  presence_t message = tests::presence(microseconds());
  message.name = "other";
  give(17);
  EXPECT_THAT(all<Register>(present(message, there)), IsEmpty());
  answer(tests::reply(name(17), "yes"));
  // At most once a second.
  EXPECT_THAT(all<Register>(present(message, there)), IsEmpty());
  pass(1s);
  message.utime = microseconds();
  const Actions actions = present(message, there);
  EXPECT_EQ(only<Unregister>(actions).number, registration);
  EXPECT_EQ(only<Register>(actions).announcement.name, "other");
}

TEST_F(BridgeTest, ReportsThatALongMessageIsNotRead) {
  EXPECT_THAT(log_of(sut->on_fragment("MILLRACE_REPLY." + uuid, there, now.steady)),
              HasSubstr("is longer than 65499 bytes; ignored"));
}

std::filesystem::path data(const std::string& name) {
  return millrace::tests::test_data("config") / name;
}

TEST(LcmConfig, StaysOnThisHostByDefault) {
  const auto sut = load(data("good/empty.lcm.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->network.group, "239.255.76.67");
  EXPECT_EQ(sut->network.port, 7667);
  EXPECT_EQ(sut->network.ttl, 0);
  EXPECT_EQ(sut->network.interface, "127.0.0.1");
  EXPECT_EQ(sut->rules.silence, 1s);
  EXPECT_TRUE(sut->rules.any_uuid);
  EXPECT_FALSE(sut->mirror);
}

TEST(LcmConfig, ReadsEveryField) {
  const auto sut = load(data("good/full.lcm.textproto"));
  ASSERT_TRUE(sut) << sut.error();
  EXPECT_EQ(sut->network.group, "239.1.2.3");
  EXPECT_EQ(sut->network.port, 7668);
  EXPECT_EQ(sut->network.ttl, 1);
  EXPECT_EQ(sut->network.interface, "192.168.7.1");
  EXPECT_EQ(sut->rules.silence, 2s);
  EXPECT_FALSE(sut->rules.any_uuid);
  const ServiceRule* const rule = sut->rules.find("560aacbf-6335-44a9-895a-8b27f3ed5e47");
  ASSERT_NE(rule, nullptr);
  EXPECT_THAT(rule->channels, ElementsAre(fabric::ChannelScope{"cnc", 1}));
  EXPECT_EQ(rule->delivery, fabric::Delivery::at_most_once);
  EXPECT_EQ(rule->concurrency, 4U);
  EXPECT_EQ(rule->encoding, Encoding::cp1252);
  ASSERT_TRUE(sut->mirror);
  EXPECT_THAT(sut->mirror->without_text, ElementsAre("b536e110-ca9e-4198-bddb-64331366bedb"));
}

TEST(LcmConfig, NamesEachMistakeWithItsPlace) {
  millrace::tests::expect_mistakes("lcm", [](const auto& file) {
    const auto sut = load(file);
    return sut ? "no error" : sut.error();
  });
}

}  // namespace
}  // namespace millrace::services::lcm
