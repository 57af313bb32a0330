// What the bridge decides: who is there, who gets a call, what a reply is worth.
#include "services/lcm/bridge.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <millrace/drain_t.hpp>
#include <millrace/request_t.hpp>
#include <millrace/withdrawal_t.hpp>

#include "tests/unit/services/lcm/messages.hpp"

namespace millrace::services::lcm {
namespace {

using namespace std::chrono_literals;
using namespace std::string_literals;
using fabric::lcm::encode;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using tests::program;
using tests::uuid;

template <typename Wanted>
std::vector<Wanted> all(const Actions& actions) {
  std::vector<Wanted> found;
  for (const Action& action : actions) {
    if (const auto* one = std::get_if<Wanted>(&action)) {
      found.push_back(*one);
    }
  }
  return found;
}

/// The only one of its kind.
template <typename Wanted>
Wanted only(const Actions& actions) {
  const auto found = all<Wanted>(actions);
  EXPECT_EQ(found.size(), 1U);
  return found.empty() ? Wanted{} : found.front();
}

template <typename Message>
std::vector<Message> sent(const Actions& actions, const std::string& channel) {
  std::vector<Message> found;
  for (const Publish& publish : all<Publish>(actions)) {
    if (publish.channel == channel) {
      found.push_back(fabric::lcm::decode<Message>(publish.bytes).value());
    }
  }
  return found;
}

std::string said(const Actions& actions) {
  std::string text;
  for (const Say& say : all<Say>(actions)) {
    text += say.text + "\n";
  }
  return text;
}

class BridgeTest : public testing::Test {
 protected:
  Actions present(const presence_t& message, Sender sender) {
    return sut->on_message("MILLRACE_PRESENCE", encode(message), sender, now);
  }
  /// The program says that it is there and has these calls.
  Actions present(const std::vector<std::string>& calls = {}) {
    presence_t message = tests::presence(microseconds());
    for (const std::string& id : calls) {
      message.calls.emplace_back();
      message.calls.back().id = id;
      message.calls.back().attempt = 1;
    }
    message.running = static_cast<std::int32_t>(calls.size());
    message.draining = draining ? 1 : 0;
    return present(message, there);
  }
  Actions answer(const reply_t& message, std::optional<Sender> sender = {}) {
    return sut->on_message("MILLRACE_REPLY." + uuid, encode(message), sender.value_or(there), now);
  }
  [[nodiscard]] fabric::Request request(std::uint64_t number, std::uint32_t attempt = 1) const {
    return {.key = {"cnc", 1},
            .call = {5, number},
            .attempt = attempt,
            .uuid = uuid,
            .text = "Ma\xDF",
            .state = 7,
            .deadline = fabric::Time(3us)};
  }
  Actions give(std::uint64_t number, std::uint32_t attempt = 1) {
    return sut->on_call(registration, request(number, attempt), now.steady);
  }
  Actions withdraw(std::uint64_t number) {
    return sut->on_cancelled(registration, {5, number}, now.steady);
  }
  void pass(std::chrono::milliseconds time) {
    now.steady += time;
    now.wall += time;
  }
  /// The same while it is asked all the time; the last actions.
  Actions pass_in_ticks(std::chrono::milliseconds time) {
    Actions actions;
    for (auto passed = 0ms; passed < time; passed += Bridge::tick) {
      pass(std::min(Bridge::tick, time - passed));
      actions = sut->on_time(now.steady);
    }
    return actions;
  }
  [[nodiscard]] std::int64_t microseconds() const {
    return std::chrono::duration_cast<std::chrono::microseconds>(now.wall.time_since_epoch())
        .count();
  }
  static std::vector<request_t> requests(const Actions& actions) {
    return sent<request_t>(actions, "MILLRACE_REQUEST." + uuid);
  }
  static std::vector<withdrawal_t> withdrawals(const Actions& actions) {
    return sent<withdrawal_t>(actions, "MILLRACE_WITHDRAWAL." + uuid);
  }
  static std::vector<drain_t> drains(const Actions& actions) {
    return sent<drain_t>(actions, "MILLRACE_DRAIN." + uuid);
  }

  const Sender there{0x7F000001, 4000};
  const Sender elsewhere{0x7F000001, 4001};
  fabric::Moment now{fabric::SteadyTime(1h), fabric::Time(48h)};
  bool draining = false;
  Rules rules;
  std::unique_ptr<Bridge> sut = std::make_unique<Bridge>(rules);
  Registration registration = 0;
};

/// With one program that is there.
class BridgeWithProgram : public BridgeTest {
 protected:
  BridgeWithProgram() { registration = only<Register>(present()).number; }
};

TEST_F(BridgeTest, RegistersAProgramThatSaysThatItIsThere) {
  const Actions actions = present();
  EXPECT_EQ(only<Register>(actions).announcement.uuid, uuid);
  EXPECT_EQ(only<Register>(actions).announcement.name, "press");
  EXPECT_THAT(said(actions), HasSubstr("at 127.0.0.1:4000 is there: press"));
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
}

TEST_F(BridgeTest, RegistersNobodyOnItsOwn) {
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
}

TEST_F(BridgeTest, PassesOverTheChannelsOfOthers) {
  EXPECT_THAT(sut->on_message("CAMERA", "pixels", there, now), IsEmpty());
  EXPECT_THAT(sut->on_message("MILLRACE_REQUEST." + uuid, "ours", there, now), IsEmpty());
  EXPECT_THAT(sut->on_fragment("CAMERA", there, now.steady), IsEmpty());
}

TEST_F(BridgeTest, RegistersTwoProgramsOfOneUuidAndTellsThemApart) {
  const Registration first = only<Register>(present()).number;
  presence_t other = tests::presence(microseconds());
  other.program = 43;
  const Registration second = only<Register>(present(other, elsewhere)).number;
  EXPECT_NE(first, second);
  EXPECT_EQ(requests(sut->on_call(second, request(1), now.steady)).at(0).program, 43);
  EXPECT_EQ(requests(sut->on_call(first, request(2), now.steady)).at(0).program, 42);
}

TEST_F(BridgeWithProgram, LosesOneThatIsSilent) {
  give(1);
  EXPECT_THAT(pass_in_ticks(rules.silence), IsEmpty());
  const Actions actions = pass_in_ticks(1ms);
  EXPECT_EQ(only<Unregister>(actions).number, registration);
  EXPECT_THAT(said(actions), HasSubstr("is gone: silent for 1000 ms; of its calls 1 go on"));
  // Not a word to the NC program: the call moves on.
  EXPECT_THAT(all<Answer>(actions), IsEmpty());
  EXPECT_THAT(give(2), IsEmpty());
  EXPECT_EQ(sut->programs(), 0U);
}

TEST_F(BridgeWithProgram, RegistersOneAnewThatComesBack) {
  pass_in_ticks(rules.silence + 1ms);
  EXPECT_GT(only<Register>(present()).number, registration);
}

TEST_F(BridgeWithProgram, LosesNobodyBecauseItStoodStillItself) {
  pass_in_ticks(200ms);
  pass(10s);
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
  EXPECT_THAT(pass_in_ticks(rules.silence - 200ms), IsEmpty());
  EXPECT_THAT(all<Unregister>(pass_in_ticks(1ms)), SizeIs(1));
}

TEST_F(BridgeWithProgram, BelievesNobodyElseWhoHasItsNumber) {
  const Actions actions = present(tests::presence(microseconds()), elsewhere);
  EXPECT_THAT(all<Register>(actions), IsEmpty());
  EXPECT_THAT(said(actions), HasSubstr("is at 127.0.0.1:4000 and, so it says, at 127.0.0.1:4001"));
  // It does not keep the first one alive either.
  pass_in_ticks(rules.silence);
  present(tests::presence(microseconds()), elsewhere);
  EXPECT_EQ(only<Unregister>(pass_in_ticks(1ms)).number, registration);
}

TEST_F(BridgeTest, BelievesNoPresenceOutOfALog) {
  const Actions actions = present(tests::presence(microseconds() - 3'600'000'000), there);
  EXPECT_THAT(all<Register>(actions), IsEmpty());
  EXPECT_THAT(said(actions),
              HasSubstr("3600000 ms before now: the clocks differ, or a log is played"));
  EXPECT_THAT(said(present(tests::presence(microseconds() + 1'001'000), elsewhere)), IsEmpty());
}

TEST_F(BridgeTest, ServesOnlyTheUuidsThatAreNamedIfItIsToldTo) {
  rules.any_uuid = false;
  rules.services["other"] = {};
  sut = std::make_unique<Bridge>(rules);
  EXPECT_THAT(said(present()), HasSubstr("which the configuration does not name"));
  presence_t named = tests::presence(microseconds());
  named.uuid = "other";
  EXPECT_EQ(only<Register>(present(named, there)).announcement.uuid, "other");
}

TEST_F(BridgeTest, KeepsToTheRulesOfAUuidWhateverAProgramSays) {
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

TEST_F(BridgeTest, LetsNoMoreProgramsInThanThereIsRoomFor) {
  for (std::int64_t number = 1; number <= 20'000; ++number) {
    presence_t message = tests::presence(microseconds());
    message.program = number;
    const Actions actions = present(message, there);
    if (number == 65) {
      EXPECT_THAT(said(actions), HasSubstr("64 programs are there, and no more are let in"));
    } else if (number > 65) {
      ASSERT_THAT(actions, IsEmpty());
    }
  }
  EXPECT_EQ(sut->programs(), 64U);
}

TEST_F(BridgeWithProgram, GivesACallWithAllThatBelongsToIt) {
  const auto given = requests(give(17));
  ASSERT_THAT(given, SizeIs(1));
  const request_t& message = given.front();
  EXPECT_EQ(message.program, program);
  EXPECT_EQ(message.call.id, "5-17");
  EXPECT_EQ(message.call.attempt, 1);
  EXPECT_EQ(message.machine, "cnc");
  EXPECT_EQ(message.channel, 1);
  EXPECT_EQ(message.uuid, uuid);
  EXPECT_EQ(message.text, "Maß");
  EXPECT_EQ(message.state, 7);
  EXPECT_EQ(message.deadline, 3);
}

TEST_F(BridgeWithProgram, SendsARequestAgainWhileItsProgramDoesNotShowIt) {
  give(17);
  pass(50ms);
  // This presence may have been written before.
  EXPECT_THAT(present(), IsEmpty());
  pass(200ms);
  EXPECT_THAT(requests(present()), SizeIs(1));
  pass(200ms);
  EXPECT_THAT(present({"5-17"}), IsEmpty());
  pass(200ms);
  // It is done, and its answer got lost.
  EXPECT_THAT(requests(present()), SizeIs(1));
}

TEST_F(BridgeWithProgram, BringsAnAnswerBackOnce) {
  give(17);
  const Actions actions = answer(tests::reply("5-17", "Maß", 3));
  const auto sut_answer = only<Answer>(actions);
  EXPECT_EQ(sut_answer.number, registration);
  EXPECT_EQ(sut_answer.call, (fabric::CallId{5, 17}));
  EXPECT_EQ(sut_answer.result, (sdk::Response{"Ma\xDF", 3}));
  // The same again is what a program does that was asked twice.
  EXPECT_THAT(answer(tests::reply("5-17", "Maß", 3)), IsEmpty());
}

TEST_F(BridgeWithProgram, TakesNoAnswerFromAnotherSocket) {
  give(17);
  const Actions forged = answer(tests::reply("5-17", "yes"), elsewhere);
  EXPECT_THAT(all<Answer>(forged), IsEmpty());
  EXPECT_THAT(said(forged), HasSubstr("comes from 127.0.0.1:4001 in the name of program"));
  EXPECT_THAT(answer(tests::reply("5-17", "yes"), elsewhere), IsEmpty());
  EXPECT_THAT(all<Answer>(answer(tests::reply("5-17", "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, TakesNoAnswerFromAnotherProgramThanTheOneThatWasAsked) {
  presence_t other = tests::presence(microseconds());
  other.program = 43;
  present(other, elsewhere);
  give(17);
  reply_t message = tests::reply("5-17", "yes");
  message.program = 43;
  const Actions actions = answer(message, elsewhere);
  EXPECT_THAT(all<Answer>(actions), IsEmpty());
  EXPECT_THAT(said(actions), HasSubstr("answers attempt 1 of call 5-17, which it was not given"));
}

TEST_F(BridgeWithProgram, TakesNoAnswerToWhatNobodyAsked) {
  EXPECT_THAT(said(answer(tests::reply("5-18", "yes"))), HasSubstr("which it was not given"));
  give(17);
  reply_t later = tests::reply("5-17", "yes");
  later.call.attempt = 2;
  EXPECT_THAT(all<Answer>(answer(later)), IsEmpty());
  reply_t unknown = tests::reply("5-17", "yes");
  unknown.program = 44;
  EXPECT_THAT(said(answer(unknown)), HasSubstr("but has not announced itself"));
}

TEST_F(BridgeWithProgram, SaysItOnceWhoeverSendsNonsenseTwentyThousandTimes) {
  std::size_t count = 0;
  for (int i = 0; i < 20'000; ++i) {
    count += sut->on_message("MILLRACE_REPLY." + uuid, "nonsense", there, now).size();
    count += sut->on_message("MILLRACE_REPLY." + std::to_string(i), "nonsense", there, now).size();
    count += answer(tests::reply("5-" + std::to_string(i), "forged"), elsewhere).size();
    count += present(tests::presence(1 + i), elsewhere).size();
  }
  EXPECT_EQ(count, 4U);
  pass(61s);
  present();
  EXPECT_THAT(said(sut->on_time(now.steady)), HasSubstr("and 19998 more like this in 60 s"));
}

TEST_F(BridgeWithProgram, AnswersWithAnErrorWhatTheControllerCannotHave) {
  give(1);
  EXPECT_THAT(only<Answer>(answer(tests::reply("5-1", "中"))).result.error(), HasSubstr("U+4E2D"));
  give(2);
  EXPECT_THAT(only<Answer>(answer(tests::reply("5-2", "", -1))).result.error(),
              HasSubstr("state -1"));
  give(3);
  EXPECT_THAT(only<Answer>(answer(tests::reply("5-3", "", 1LL << 32))).result.error(),
              HasSubstr("state 4294967296"));
  give(4);
  reply_t failed = tests::reply("5-4", "no paper");
  failed.kind = reply_t::FAILED;
  EXPECT_EQ(only<Answer>(answer(failed)).result.error(), "no paper");
  // The rest is refused by the library that all services share.
  give(5);
  EXPECT_EQ(only<Answer>(answer(tests::reply("5-5", std::string(200, 'x'), 0))).result,
            (sdk::Response{std::string(200, 'x'), 0}));
}

TEST_F(BridgeWithProgram, PassesInterimAnswersOnAtAPaceAndNeverLosesTheLast) {
  give(17);
  const auto interim = [&](int number) {
    reply_t message = tests::reply("5-17", std::to_string(number), number);
    message.kind = reply_t::INTERIM;
    return answer(message);
  };
  EXPECT_EQ(only<Progress>(interim(1)).response, (sdk::Response{"1", 1}));
  for (int i = 2; i <= 20'000; ++i) {
    ASSERT_THAT(interim(i), IsEmpty());
  }
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
  pass(Bridge::interim_pause);
  EXPECT_EQ(only<Progress>(sut->on_time(now.steady)).response, (sdk::Response{"20000", 20'000}));
  EXPECT_THAT(sut->on_time(now.steady), IsEmpty());
}

TEST_F(BridgeWithProgram, LeavesOutAnInterimAnswerThatDoesNotFit) {
  give(17);
  reply_t message = tests::reply("5-17", std::string(128, 'x'));
  message.kind = reply_t::INTERIM;
  EXPECT_THAT(said(answer(message)), HasSubstr("is left out: it has 128 bytes, at most 127 fit"));
  EXPECT_THAT(all<Answer>(answer(tests::reply("5-17", "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, SaysThatACallIsWithdrawnUntilItsProgramHasHeardIt) {
  give(17);
  const auto first = withdrawals(withdraw(17));
  ASSERT_THAT(first, SizeIs(1));
  EXPECT_EQ(first.front().program, program);
  EXPECT_EQ(first.front().call.id, "5-17");
  EXPECT_THAT(withdraw(17), IsEmpty());
  pass(200ms);
  EXPECT_THAT(withdrawals(present({"5-17"})), SizeIs(1));
  pass(200ms);
  // Only now its place is free.
  EXPECT_EQ(only<Answer>(present()).call, (fabric::CallId{5, 17}));
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
}

TEST_F(BridgeWithProgram, EndsAWithdrawnCallWithTheAnswerThatComesAllTheSame) {
  give(17);
  withdraw(17);
  EXPECT_EQ(only<Answer>(answer(tests::reply("5-17", "late"))).call, (fabric::CallId{5, 17}));
  EXPECT_THAT(answer(tests::reply("5-17", "late")), IsEmpty());
}

TEST_F(BridgeWithProgram, TakesForTheRunThatIsWantedAgainNoAnswerOfTheOneThatWasGivenUp) {
  give(17);
  withdraw(17);
  pass(200ms);
  present();
  give(17, 2);
  EXPECT_THAT(answer(tests::reply("5-17", "of the first run")), IsEmpty());
  reply_t second = tests::reply("5-17", "of the second run");
  second.call.attempt = 2;
  EXPECT_EQ(only<Answer>(answer(second)).result->text, "of the second run");
}

TEST_F(BridgeWithProgram, TakesAnAnswerOfTheAttemptThatStillRuns) {
  // The bridge was started anew, or had lost the program, which went on with attempt 1.
  give(17, 2);
  EXPECT_THAT(all<Answer>(answer(tests::reply("5-17", "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, HasAProgramDrainThatSaysSo) {
  give(17);
  draining = true;
  EXPECT_EQ(only<Drain>(present({"5-17"})).number, registration);
  pass(200ms);
  EXPECT_THAT(present({"5-17"}), IsEmpty());
  EXPECT_THAT(all<Answer>(answer(tests::reply("5-17", "yes"))), SizeIs(1));
  EXPECT_EQ(only<Unregister>(sut->on_drained(registration)).number, registration);
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
  draining = false;
  pass(1s);
  EXPECT_THAT(all<Register>(present()), SizeIs(1));
}

TEST_F(BridgeWithProgram, TellsAProgramThatAnOperatorWantsItToLeaveUntilItDoes) {
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

TEST_F(BridgeWithProgram, RegistersAProgramAnewThatSaysSomethingElseOnceItIsIdle) {
  presence_t message = tests::presence(microseconds());
  message.name = "other";
  give(17);
  EXPECT_THAT(all<Register>(present(message, there)), IsEmpty());
  answer(tests::reply("5-17", "yes"));
  // Nor more often than once a second.
  EXPECT_THAT(all<Register>(present(message, there)), IsEmpty());
  pass(1s);
  message.utime = microseconds();
  const Actions actions = present(message, there);
  EXPECT_EQ(only<Unregister>(actions).number, registration);
  EXPECT_EQ(only<Register>(actions).announcement.name, "other");
}

TEST_F(BridgeWithProgram, DoesNotTryAgainWhatWasRefused) {
  EXPECT_THAT(said(sut->on_refused(registration, "no", now.steady)),
              HasSubstr("cannot be served: no"));
  EXPECT_THAT(present(), IsEmpty());
  pass(1s);
  EXPECT_THAT(present(), IsEmpty());
  presence_t message = tests::presence(microseconds());
  message.name = "other";
  EXPECT_THAT(all<Register>(present(message, there)), SizeIs(1));
}

TEST_F(BridgeTest, SaysThatALongMessageIsNotRead) {
  EXPECT_THAT(said(sut->on_fragment("MILLRACE_REPLY." + uuid, there, now.steady)),
              HasSubstr("is longer than 65499 bytes, and is not read"));
}

}  // namespace
}  // namespace millrace::services::lcm
