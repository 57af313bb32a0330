#include "fabric/plant/assess.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "tests/unit/fabric/plant/samples.hpp"

namespace millrace::fabric::plant {
namespace {

namespace messages = base::messages;
using namespace samples;
using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

class AnAssessment : public testing::Test {
 protected:
  AnAssessment() { plant.add(machine("press", true)); }

  /// "act held press/1", … in their order.
  std::vector<std::string> kinds(std::chrono::nanoseconds after = 1h) {
    found = assess(plant, noon + after, {.flags = " --domain 7"});
    std::vector<std::string> words;
    for (const Concern& concern : found) {
      words.push_back(std::string(name_of(concern.level)) + " " +
                      std::string(name_of(concern.kind)) + " " + subject_of(concern).text);
    }
    return words;
  }
  std::string_view state_of(std::uint16_t number, std::chrono::nanoseconds after = 1h) {
    return view_of(plant, plant.channels().at({"press", number}), noon + after).state;
  }

  Plant plant;
  std::vector<Concern> found;
};

TEST_F(AnAssessment, IsEmptyWhereAllIsWell) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::running, square_root));
  EXPECT_THAT(kinds(59s), IsEmpty());
  EXPECT_EQ(level_of(found), Level::fine);
}

TEST_F(AnAssessment, HasWhatNeedsAPersonFirstThenTheMoreUrgentThenTheOldest) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::waiting, square_root, noon + 1h - 10s));
  plant.add(channel(2, ChannelState::unserved, "b"));
  plant.add(channel(3, ChannelState::held, square_root, noon + 2s));
  plant.add(channel(4, ChannelState::held, square_root, noon + 1s));
  plant.add(machine("mill", false));
  EXPECT_THAT(kinds(), ElementsAre("act held press/4", "act held press/3", "act link down mill",
                                   "act unserved press/2", "look waiting press/1"));
  EXPECT_EQ(level_of(found), Level::act);
}

TEST_F(AnAssessment, NamesTheStepsOfAHeldCallWithTheFlagsOfItsView) {
  plant.add(channel(3, ChannelState::held, square_root));
  ASSERT_THAT(kinds(), SizeIs(1));
  EXPECT_EQ(found[0].who, Role::operator_);
  EXPECT_EQ(advice_of(found[0].todo),
            "start the service: it has no running instance; check the machine, then either answer "
            "the call yourself or retry it: `millrace answer press/3 --domain 7 RESPONSE --state "
            "N`, `millrace retry press/3 --domain 7`");
  plant.add(instance(1, "a"));
  kinds();
  EXPECT_EQ(found[0].todo.front(), messages::check_machine());
}

TEST_F(AnAssessment, HasAMissingServiceAfterAMomentAndAnUnknownOneAfterTwo) {
  plant.add(channel(1, ChannelState::unserved, square_root, noon,
                    messages::no_instance(square_root, "a")));
  EXPECT_THAT(kinds(900ms), IsEmpty());
  EXPECT_THAT(kinds(1100ms), ElementsAre("act unserved press/1"));
  EXPECT_EQ(found[0].who, Role::engineer);
  plant.add(
      channel(1, ChannelState::unserved, square_root, noon,
              messages::unknown_uuid_near(square_root, "b", messages::one_character_differs())));
  EXPECT_THAT(kinds(1900ms), IsEmpty());
  EXPECT_THAT(kinds(2100ms), ElementsAre("act unserved press/1"));
  EXPECT_EQ(found[0].who, Role::programmer);
}

TEST_F(AnAssessment, LooksAtACallThatWaitsForAnInstanceAndThenNeedsAPerson) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::waiting, square_root));
  EXPECT_THAT(kinds(4s), IsEmpty());
  EXPECT_THAT(kinds(6s), ElementsAre("look waiting press/1"));
  EXPECT_THAT(kinds(59s), ElementsAre("look waiting press/1"));
  EXPECT_THAT(kinds(61s), ElementsAre("act waiting press/1"));
}

TEST_F(AnAssessment, TakesACallThatWaitsWithoutAnyInstanceForUnserved) {
  plant.add(channel(1, ChannelState::waiting, square_root));
  EXPECT_THAT(kinds(2s), ElementsAre("act unserved press/1"));
  EXPECT_EQ(state_of(1), "unserved");
  plant.add(instance(1, "a"));
  EXPECT_EQ(state_of(1), "waiting");
}

TEST_F(AnAssessment, LooksAtACallThatRunsLongerThanItsTime) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::running, square_root, noon, messages::deadline("30 s")));
  EXPECT_THAT(kinds(), ElementsAre("look overdue press/1"));
  EXPECT_EQ(state_of(1), "overdue");
}

TEST_F(AnAssessment, LooksAtACallThatRunsFarLongerThanTheOthersOfItsService) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::running, square_root));
  EXPECT_THAT(kinds(59s), IsEmpty());
  EXPECT_THAT(kinds(61s), ElementsAre("look overdue press/1"));
  EXPECT_EQ(found[0].what, messages::what_runs_long());
  // A service whose calls take ten seconds each.
  plant.add(entry(InstanceStatus{.instance = id(1), .answered = 5, .mean = 10s}));
  EXPECT_THAT(kinds(99s), IsEmpty());
  EXPECT_THAT(kinds(101s), ElementsAre("look overdue press/1"));
}

TEST_F(AnAssessment, NamesTheCallsThatOccupyTheInstancesOfAWaitingCall) {
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::waiting, square_root, noon, messages::only_instance_busy()));
  plant.add(channel(2, ChannelState::running, square_root));
  plant.add(channel(3, ChannelState::running, "another"));
  kinds(10s);
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].why, messages::occupied_by(messages::only_instance_busy(), "press/2"));
}

TEST_F(AnAssessment, NamesTheLostInstanceWhicheverIsSeenFirstTheWaitOrTheLoss) {
  plant.add(instance(1, "a"));
  plant.add(instance_gone(1, noon + 1s));
  for (const auto since : {noon, noon + 2s}) {
    plant.add(channel(1, ChannelState::waiting, square_root, since,
                      messages::no_instance_ready(square_root, "press/1")));
    EXPECT_THAT(kinds(), ElementsAre("act unserved press/1"));
    EXPECT_EQ(found[0].why, messages::last_instance_was("a", 0, "vm"));
  }
}

TEST_F(AnAssessment, SaysThatAnInstanceDoesNotRespondUntilItsProcessIsGone) {
  plant.add(instance(1, "a"));
  plant.add(instance_silent(1, noon));
  EXPECT_THAT(kinds(), ElementsAre("act unserved " + square_root));
  EXPECT_EQ(found[0].why, messages::last_instance_silent("a", 0, "vm"));
  EXPECT_EQ(found[0].todo.front(), messages::see_whether_it_runs());
  plant.add(instance_gone(1, noon + 10s));
  kinds();
  EXPECT_EQ(found[0].why, messages::last_instance_was("a", 0, "vm"));
  EXPECT_EQ(found[0].since, noon) << "since it fell silent";
  plant.add(instance_silent(1, noon + 11s));
  kinds();
  EXPECT_EQ(found[0].why, messages::last_instance_was("a", 0, "vm")) << "it was gone already";
}

TEST_F(AnAssessment, HasNoConcernAboutAnInstanceThatRespondsAgain) {
  plant.add(instance(1, "a"));
  plant.add(instance_silent(1, noon));
  plant.add(instance(1, "a"));
  EXPECT_THAT(kinds(), IsEmpty());
}

TEST_F(AnAssessment, SaysHowAGatewayLeftItsMachine) {
  auto status = machine_status("press", true);
  status.host = "hall";
  status.pid = 4711;
  for (const auto& [reason, why] : std::vector<std::pair<Message, Message>>{
           {messages::gateway_not_responding(), messages::gateway_silent("hall", 4711)},
           {messages::gateway_gone(), messages::gateway_was("hall", 4711)},
           {messages::gateway_released(), messages::gateway_ended("hall", 4711)}}) {
    plant = {};
    plant.add(entry(status));
    auto gone = machine_status("press", false);
    gone.gone = true;
    gone.reason = reason;
    gone.since = noon;
    plant.add(entry(gone));
    EXPECT_THAT(kinds(), ElementsAre("act gateway gone press"));
    EXPECT_EQ(found[0].why, why);
    EXPECT_EQ(found[0].since, noon);
    // Later DDS forgets its process.
    gone.reason = messages::gateway_gone();
    gone.since = noon + 100s;
    plant.add(entry(gone));
    kinds();
    EXPECT_EQ(found[0].since, noon);
  }
}

TEST_F(AnAssessment, WaitsAMomentForAGatewayThatIsOnlyLate) {
  auto late = machine_status("press", false);
  late.gone = true;
  late.reason = messages::gateway_not_responding();
  late.since = noon;
  plant.add(channel(1, ChannelState::idle));
  plant.add(entry(late));
  EXPECT_THAT(kinds(900ms), IsEmpty());
  EXPECT_EQ(state_of(1, 900ms), "idle");
  EXPECT_THAT(kinds(1100ms), ElementsAre("act gateway gone press"));
  EXPECT_EQ(state_of(1, 1100ms), "gateway gone");
}

TEST_F(AnAssessment, KeepsTheLostLinkOfAGatewayThatIsOnlyLate) {
  plant.add(machine("press", false));
  plant.add(channel(1, ChannelState::link_down));
  EXPECT_THAT(kinds(), ElementsAre("act link down press"));
  const std::vector<Concern> before = found;
  auto late = machine_status("press", false, noon + 1h);
  late.gone = true;
  late.reason = messages::gateway_not_responding();
  plant.add(entry(late));
  kinds(1h + 900ms);
  EXPECT_EQ(found, before);
  EXPECT_THAT(kinds(1h + 1100ms), ElementsAre("act gateway gone press"));
}

TEST_F(AnAssessment, KeepsTheHeldCallOfAGatewayThatIsOnlyLate) {
  auto late = machine_status("press", false);
  late.gone = true;
  late.reason = messages::gateway_not_responding();
  late.since = noon;
  plant.add(channel(1, ChannelState::held, square_root, noon, "its instance exited"));
  ChannelStatus gone{.key = {"press", 1}, .since = noon, .reason = messages::gateway_gone()};
  gone.gone = true;
  plant.add(entry(gone));
  plant.add(entry(late));
  EXPECT_THAT(kinds(900ms), ElementsAre("act held press/1"));
  EXPECT_EQ(found[0].why, "its instance exited");
  EXPECT_THAT(kinds(1100ms), ElementsAre("act gateway gone press"));
  EXPECT_EQ(view_of(plant, plant.channels().at({"press", 1}), noon + 1100ms).why,
            messages::gateway_gone());
}

TEST_F(AnAssessment, LooksAtAProcessThatSaidThatItRunsAndIsGoneWithoutAWord) {
  const Alarm runs = alarm_of(3, "recording", AlarmLevel::fine);
  const auto over = [&](bool is_lost) {
    return entry(observer::AlarmNews{.over = true, .alarm = {.key = runs.key}, .lost = is_lost});
  };
  plant.add(entry(observer::AlarmNews{.alarm = runs}));
  EXPECT_THAT(kinds(), IsEmpty());
  plant.add(over(true));
  EXPECT_THAT(kinds(), ElementsAre("look process gone archiver on vm, pid 7"));
  EXPECT_EQ(found[0].why, messages::process_left_without_word());
  // Another process does its work.
  Alarm next = runs;
  next.key.responder = id(4);
  plant.add(entry(observer::AlarmNews{.alarm = next}));
  EXPECT_THAT(kinds(), IsEmpty());
  // This one leaves in order.
  plant.add(entry(observer::AlarmNews{.over = true, .alarm = {.key = next.key}}));
  EXPECT_THAT(kinds(), IsEmpty());
}

TEST_F(AnAssessment, NamesTheReasonThatAProcessGaveBeforeItsEnd) {
  const Alarm full = alarm_of(3, "recording", AlarmLevel::problem);
  plant.add(entry(observer::AlarmNews{.alarm = full}));
  plant.add(entry(observer::AlarmNews{.over = true, .alarm = {.key = full.key}, .lost = true}));
  ASSERT_THAT(kinds(), ElementsAre("look process gone archiver on vm, pid 7"));
  EXPECT_EQ(found[0].why, full.text);
}

TEST_F(AnAssessment, HasTheErrorsOfAServiceOnceThoughSeveralGatewaysReportThem) {
  plant.add(alarm(1, "errors", AlarmLevel::warning, square_root));
  plant.add(alarm(2, "errors", AlarmLevel::problem, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act errors " + square_root));
  EXPECT_EQ(found[0].who, Role::programmer);
}

TEST_F(AnAssessment, HasTheChannelsOfOneServiceTogether) {
  plant.add(channel(1, ChannelState::unserved, square_root, noon + 1s));
  plant.add(channel(2, ChannelState::unserved, square_root, noon));
  EXPECT_THAT(kinds(), ElementsAre("act unserved press/2, press/1"));
  EXPECT_EQ(found[0].since, noon);
}

TEST_F(AnAssessment, HasAGatewayThatIsGoneOnceWithItsMachinesAndSaysWhatItsJournalMeans) {
  for (const auto& [journal, advice] : std::map<JournalState, Message>{
           {JournalState::kept, messages::restart_gateway_with_journal("hall")},
           {JournalState::none, messages::restart_gateway_without_journal("hall")},
           {JournalState::not_known, messages::restart_gateway("hall")}}) {
    plant = {};
    for (const char* name : {"press", "mill"}) {
      auto status = machine_status(name, true);
      status.host = "hall";
      status.pid = 4711;
      status.journal = journal;
      plant.add(entry(status));
    }
    plant.add(channel(1, ChannelState::running, square_root));
    plant.add(gone_machine("press"));
    plant.add(gone_machine("mill"));
    EXPECT_THAT(kinds(), ElementsAre("act gateway gone mill, press"));
    EXPECT_EQ(found[0].why, messages::gateway_was("hall", 4711));
    EXPECT_THAT(found[0].todo, ElementsAre(advice));
    EXPECT_THAT(found[0].channels, SizeIs(1));
    EXPECT_EQ(state_of(1), "gateway gone");
  }
}

TEST_F(AnAssessment, HasALinkThatIsDownOnceWithItsChannelsSinceItWentDown) {
  plant.add(machine("press", false, noon - 5s));
  plant.add(channel(1, ChannelState::link_down));
  plant.add(channel(2, ChannelState::running, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act link down press"));
  EXPECT_EQ(found[0].since, noon - 5s);
  EXPECT_EQ(found[0].why.text, "no route");
  EXPECT_THAT(found[0].channels, SizeIs(2));
  EXPECT_EQ(state_of(2), "link down");
}

TEST_F(AnAssessment, HasNoConcernForAGatewayThatStandsBy) {
  auto standby = machine_status("press", false);
  standby.gateway = id(98);
  plant.add(entry(standby));
  EXPECT_THAT(kinds(), IsEmpty());
}

TEST_F(AnAssessment, HasAControllerThatTwoGatewaysServeUnderDifferentNames) {
  const auto add = [&](const std::string& name, std::uint8_t gateway, const std::string& address,
                       std::vector<std::uint16_t> channels = {}) {
    auto status = machine_status(name, true);
    status.gateway = id(gateway);
    status.address = address;
    status.claims = std::move(channels);
    status.host = "hall-" + std::to_string(gateway);
    plant.add(entry(status));
  };
  add("mill", 1, "10.0.0.5:48898, 10.0.0.5.1.1");
  add("lathe", 2, "10.0.0.6:48898, 10.0.0.6.1.1", {1});
  add("lathe_too", 3, "10.0.0.6:48898, 10.0.0.6.1.1", {2});
  add("virtual_1", 4, "127.0.0.1:48898, 127.0.0.1.1.1");
  add("virtual_2", 5, "127.0.0.1:48898, 127.0.0.1.1.1");
  EXPECT_THAT(kinds(), IsEmpty());
  add("copied", 6, "10.0.0.5:48898, 10.0.0.5.1.1", {2});
  EXPECT_THAT(kinds(), ElementsAre("act alarm copied, mill"));
  EXPECT_EQ(found[0].why,
            messages::same_controller("hall-6", "hall-1", "10.0.0.5:48898, 10.0.0.5.1.1"));
}

TEST_F(AnAssessment, KnowsAFabricWithoutAnyGateway) {
  plant = {};
  EXPECT_THAT(kinds(), ElementsAre("act no gateway "));
}

TEST_F(AnAssessment, NamesTheOtherFabricsOfTheDomainWhereThisOneHasNoGateway) {
  plant.set_other_fabrics({"hall", "press"});
  EXPECT_THAT(kinds(), IsEmpty());
  plant = {};
  plant.set_other_fabrics({"hall", "press"});
  EXPECT_THAT(kinds(), ElementsAre("act no gateway "));
  EXPECT_EQ(found[0].why,
            "no controller is asked for calls; this domain also has the fabrics hall, press");
  EXPECT_EQ(found[0].todo.front(), messages::join_other_fabric());
}

TEST_F(AnAssessment, HasAJournalThatCannotBeWrittenOnceWithTheChannelsThatWaitForIt) {
  plant.add(alarm(99, "journal", AlarmLevel::problem));
  EXPECT_THAT(kinds(), ElementsAre("act journal press"));
  plant.add(channel(1, ChannelState::unserved, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act journal press"));
  EXPECT_THAT(found[0].channels, SizeIs(1));
  EXPECT_EQ(state_of(1), "journal");
}

TEST_F(AnAssessment, NeedsAPersonForAnAbortedProgramButShowsTheCallThatMayHaveAbortedIt) {
  plant.add(channel(1, ChannelState::idle));
  plant.add(channel(2, ChannelState::idle));
  plant.add(channel(3, ChannelState::unserved, square_root));
  plant.add(channel(4, ChannelState::running, square_root));
  plant.add(program(1, ProgramEventKind::aborted));
  plant.add(program(2, ProgramEventKind::on_hold));
  plant.add(program(3, ProgramEventKind::aborted));
  plant.add(program(4, ProgramEventKind::on_hold));
  EXPECT_THAT(kinds(30s), ElementsAre("act unserved press/3", "act program aborted press/1",
                                      "look program on hold press/2"));
  EXPECT_EQ(found[1].why, messages::program_and_error("good.nc", 455));
  EXPECT_EQ(state_of(1), "program aborted");
  EXPECT_EQ(state_of(2), "program on hold");
  EXPECT_EQ(state_of(3), "unserved");
  EXPECT_EQ(state_of(4, 30s), "running");
  const auto view = view_of(plant, plant.channels().at({"press", 1}), noon + 1h);
  EXPECT_EQ(view.call, "idle");
  EXPECT_EQ(view.call_level, Level::fine);
}

TEST_F(AnAssessment, HasTheAlarmsOfProcessesByTheirLevel) {
  plant.add(alarm(7, "archive", AlarmLevel::problem));
  plant.add(alarm(8, "certificate", AlarmLevel::warning));
  plant.add(alarm(9, "recording", AlarmLevel::fine));
  plant.add(alarm(7, "of_tomorrow", static_cast<AlarmLevel>(77)));
  EXPECT_THAT(kinds(),
              ElementsAre("act alarm archiver on vm, pid 7", "act alarm archiver on vm, pid 7",
                          "look alarm archiver on vm, pid 7"));
  EXPECT_EQ(found[0].what, messages::what_archive());
  EXPECT_EQ(found[1].what, messages::what_alarm("archiver"));
}

TEST_F(AnAssessment, HasAServiceThatLostItsLastInstanceOnceHoweverManyReportIt) {
  plant.add(alarm(98, "service", AlarmLevel::warning, square_root));
  plant.add(alarm(99, "service", AlarmLevel::warning, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act unserved " + square_root));
  plant.add(channel(1, ChannelState::unserved, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act unserved press/1"));
  plant.add(instance(1, "a"));
  plant.add(channel(1, ChannelState::idle));
  EXPECT_THAT(kinds(), IsEmpty());
}

TEST_F(AnAssessment, LooksAtAServiceThatLostOneOfItsInstancesUntilANewOneIsThere) {
  plant.add(instance(1, "a"));
  plant.add(instance(2, "b"));
  plant.add(instance_gone(2, noon));
  EXPECT_THAT(kinds(900ms), IsEmpty());
  EXPECT_THAT(kinds(2s), ElementsAre("look redundancy " + square_root));
  plant.add(instance(3, "b"));
  EXPECT_THAT(kinds(2s), IsEmpty());
  plant.add(instance(3, "b", true));
  plant.add(instance_gone(3, noon));
  EXPECT_THAT(kinds(2s), IsEmpty()) << "the new one has left in order";
}

TEST_F(AnAssessment, CountsAnInstanceThatIsBackFromSilenceAsNoNewOne) {
  plant.add(instance(1, "a"));
  plant.add(instance(2, "a"));
  plant.add(instance(3, "a"));
  plant.add(instance_gone(1, noon));
  plant.add(instance_gone(2, noon));
  plant.add(instance(2, "a"));
  EXPECT_THAT(kinds(2s), ElementsAre("look redundancy " + square_root));
  plant.add(instance(1, "a"));
  EXPECT_THAT(kinds(2s), IsEmpty());
}

TEST_F(AnAssessment, NeedsAPersonWhereTheOnlyInstanceIsGoneButNotWhereItHasLeft) {
  plant.add(instance(1, "a"));
  plant.add(instance_gone(1, noon));
  EXPECT_THAT(kinds(2s), ElementsAre("act unserved " + square_root));
  plant = {};
  plant.add(machine("press", true));
  plant.add(instance(1, "a", true));
  plant.add(instance_gone(1, noon));
  EXPECT_THAT(kinds(2s), IsEmpty());
}

TEST_F(AnAssessment, SaysOnceThatTheServiceOfAHeldCallIsGone) {
  plant.add(instance(1, "a"));
  plant.add(instance_gone(1, noon));
  plant.add(channel(1, ChannelState::held, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act held press/1"));
  plant.add(channel(2, ChannelState::unserved, square_root));
  EXPECT_THAT(kinds(), ElementsAre("act held press/1", "act unserved press/2"));
}

TEST_F(AnAssessment, LooksAtAStateOfALaterVersion) {
  plant.add(channel(1, static_cast<ChannelState>(77)));
  EXPECT_THAT(kinds(), ElementsAre("look unknown press/1"));
}

TEST_F(AnAssessment, HasTheSameCauseAsLongAsItLastsAndAnotherOneForTheNextCall) {
  auto status = channel_status(1, ChannelState::held, square_root);
  status.call = {5, 1};
  plant.add(entry(status));
  kinds();
  const std::string before = found.at(0).cause;
  plant.add(machine("mill", false));
  kinds(2h);
  EXPECT_EQ(found.at(0).cause, before);
  status.call = {5, 2};
  plant.add(entry(status));
  kinds();
  EXPECT_NE(found.at(0).cause, before);
}

}  // namespace
}  // namespace millrace::fabric::plant
