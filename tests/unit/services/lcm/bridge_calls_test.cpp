// The bridge's decisions about a call: its dispatch, and the validity of replies.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <millrace/mirror_event_t.hpp>
#include <millrace/mirror_request_t.hpp>

#include "fabric/lcm/message.hpp"
#include "fabric/lcm/mirror.hpp"
#include "tests/unit/services/lcm/bridge.hpp"

namespace millrace::services::lcm {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;
using tests::program;
using tests::uuid;

TEST_F(BridgeWithProgram, PassesACallWithAllItsData) {
  const auto given = requests(give(17));
  ASSERT_THAT(given, SizeIs(1));
  const request_t& message = given.front();
  EXPECT_EQ(message.program, program);
  EXPECT_THAT(message.call.id, StartsWith("5-17."));
  EXPECT_EQ(message.call.attempt, 1);
  EXPECT_EQ(message.machine, "cnc");
  EXPECT_EQ(message.channel, 1);
  EXPECT_EQ(message.uuid, uuid);
  EXPECT_EQ(message.text, "Maß");
  EXPECT_EQ(message.state, 7);
  EXPECT_EQ(message.deadline, 3);
}

TEST_F(BridgeWithProgram, RepeatsARequestUntilItsProgramShowsIt) {
  give(17);
  pass(50ms);
  // This presence may have been sent before.
  EXPECT_THAT(present(), IsEmpty());
  pass(200ms);
  EXPECT_THAT(requests(present()), SizeIs(1));
  pass(200ms);
  EXPECT_THAT(present({name(17)}), IsEmpty());
  pass(200ms);
  // It is finished, and its reply was lost.
  EXPECT_THAT(requests(present()), SizeIs(1));
}

TEST_F(BridgeWithProgram, ReturnsAnAnswerOnce) {
  give(17);
  const Actions actions = answer(tests::reply(name(17), "Maß", 3));
  const auto sut_answer = only<Answer>(actions);
  EXPECT_EQ(sut_answer.number, registration);
  EXPECT_EQ(sut_answer.call, (fabric::CallId{5, 17}));
  EXPECT_EQ(sut_answer.result, (sdk::Response{"Ma\xDF", 3}));
  // An LCM process that got the request twice sends the same reply again.
  EXPECT_THAT(answer(tests::reply(name(17), "Maß", 3)), IsEmpty());
}

TEST_F(BridgeWithProgram, IgnoresAnAnswerFromAnotherSocket) {
  give(17);
  const Actions forged = answer(tests::reply(name(17), "yes"), elsewhere);
  EXPECT_THAT(all<Answer>(forged), IsEmpty());
  EXPECT_THAT(log_of(forged), HasSubstr("comes from 127.0.0.1:4001 with the number of program"));
  EXPECT_THAT(answer(tests::reply(name(17), "yes"), elsewhere), IsEmpty());
  EXPECT_THAT(all<Answer>(answer(tests::reply(name(17), "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, IgnoresAnAnswerFromAnotherProgram) {
  presence_t other = tests::presence(microseconds());
  other.program = 43;
  present(other, elsewhere);
  give(17);
  reply_t message = tests::reply(name(17), "yes");
  message.program = 43;
  const Actions actions = answer(message, elsewhere);
  EXPECT_THAT(all<Answer>(actions), IsEmpty());
  EXPECT_THAT(log_of(actions), HasSubstr("answers attempt 1 of call " + name(17) +
                                         ", which was not dispatched to it"));
}

TEST_F(BridgeWithProgram, IgnoresUnexpectedAnswers) {
  EXPECT_THAT(log_of(answer(tests::reply(name(18), "yes"))),
              HasSubstr("which was not dispatched to it"));
  give(17);
  reply_t later = tests::reply(name(17), "yes");
  later.call.attempt = 2;
  EXPECT_THAT(all<Answer>(answer(later)), IsEmpty());
  reply_t unknown = tests::reply(name(17), "yes");
  unknown.program = 44;
  EXPECT_THAT(log_of(answer(unknown)), HasSubstr("but has not announced itself"));
}

TEST_F(BridgeWithProgram, LimitsTheLogOfInvalidMessages) {
  std::size_t count = 0;
  for (unsigned i = 0; i < 20'000; ++i) {
    count += sut->on_message("MILLRACE_REPLY." + uuid, "nonsense", there, now).size();
    count += sut->on_message("MILLRACE_REPLY." + std::to_string(i), "nonsense", there, now).size();
    count += answer(tests::reply(name(i), "forged"), elsewhere).size();
    count += present(tests::presence(1 + std::int64_t{i}), elsewhere).size();
  }
  EXPECT_EQ(count, 4U);
  pass(61s);
  present();
  EXPECT_THAT(log_of(sut->on_time(now.steady)), HasSubstr("and 19998 more like this in 60 s"));
}

TEST_F(BridgeWithProgram, ReplacesAnAnswerThatTheControllerCannotHaveByAnError) {
  give(1);
  EXPECT_THAT(only<Answer>(answer(tests::reply(name(1), "中"))).result.error(),
              HasSubstr("U+4E2D"));
  give(2);
  EXPECT_THAT(only<Answer>(answer(tests::reply(name(2), "", -1))).result.error(),
              HasSubstr("state -1"));
  give(3);
  EXPECT_THAT(only<Answer>(answer(tests::reply(name(3), "", 1LL << 32))).result.error(),
              HasSubstr("state 4294967296"));
  give(4);
  reply_t failed = tests::reply(name(4), "no paper");
  failed.kind = reply_t::FAILED;
  EXPECT_EQ(only<Answer>(answer(failed)).result.error(), "no paper");
  // The SDK of all services refuses the rest.
  give(5);
  EXPECT_EQ(only<Answer>(answer(tests::reply(name(5), std::string(200, 'x'), 0))).result,
            (sdk::Response{std::string(200, 'x'), 0}));
}

TEST_F(BridgeWithProgram, LimitsTheRateOfInterimAnswersAndNeverLosesTheLast) {
  give(17);
  const auto interim = [&](int number) {
    reply_t message = tests::reply(name(17), std::to_string(number), number);
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
  reply_t message = tests::reply(name(17), std::string(128, 'x'));
  message.kind = reply_t::INTERIM;
  EXPECT_THAT(log_of(answer(message)), HasSubstr("is dropped: it has 128 bytes, at most 127 fit"));
  EXPECT_THAT(all<Answer>(answer(tests::reply(name(17), "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, RepeatsAWithdrawalUntilItsProgramHasReceivedIt) {
  give(17);
  const auto first = withdrawals(withdraw(17));
  ASSERT_THAT(first, SizeIs(1));
  EXPECT_EQ(first.front().program, program);
  EXPECT_EQ(first.front().call.id, name(17));
  EXPECT_THAT(withdraw(17), IsEmpty());
  pass(200ms);
  EXPECT_THAT(withdrawals(present({name(17)})), SizeIs(1));
  pass(200ms);
  // Only now its place is free.
  EXPECT_EQ(only<Answer>(present()).call, (fabric::CallId{5, 17}));
  pass(200ms);
  EXPECT_THAT(present(), IsEmpty());
}

TEST_F(BridgeWithProgram, EndsAWithdrawnCallWithItsLateAnswer) {
  give(17);
  withdraw(17);
  EXPECT_EQ(only<Answer>(answer(tests::reply(name(17), "late"))).call, (fabric::CallId{5, 17}));
  EXPECT_THAT(answer(tests::reply(name(17), "late")), IsEmpty());
}

TEST_F(BridgeWithProgram, IgnoresAnAnswerOfTheCancelledRunForTheNextOne) {
  give(17);
  withdraw(17);
  pass(200ms);
  present();
  give(17, 2);
  EXPECT_THAT(answer(tests::reply(name(17), "of the first run")), IsEmpty());
  reply_t second = tests::reply(name(17), "of the second run");
  second.call.attempt = 2;
  EXPECT_EQ(only<Answer>(answer(second)).result->text, "of the second run");
}

TEST_F(BridgeWithProgram, UsesAnotherNameForAnotherRequestUnderTheSameCallId) {
  // Another gateway uses a call id first, and the LCM process remembers the reply.
  fabric::Request strange = request(17);
  strange.text = "something else";
  const std::string first =
      requests(sut->on_call(registration, strange, now.steady)).front().call.id;
  answer(tests::reply(first, "its answer"));
  const std::string second = requests(give(17)).front().call.id;
  EXPECT_NE(first, second);
  EXPECT_THAT(answer(tests::reply(first, "its answer")), IsEmpty());
  EXPECT_EQ(only<Answer>(answer(tests::reply(second, "ours"))).result->text, "ours");
}

TEST_F(BridgeWithProgram, AcceptsAnAnswerOfTheAttemptThatStillRuns) {
  // The bridge was restarted, or had lost the LCM process, which continued attempt 1.
  give(17, 2);
  EXPECT_THAT(all<Answer>(answer(tests::reply(name(17), "yes"))), SizeIs(1));
}

TEST_F(BridgeWithProgram, DoesNotRetryWhatWasRefused) {
  EXPECT_THAT(log_of(sut->on_refused(registration, "no", now.steady)),
              HasSubstr("cannot be served: no"));
  EXPECT_THAT(present(), IsEmpty());
  pass(1s);
  EXPECT_THAT(present(), IsEmpty());
  presence_t message = tests::presence(microseconds());
  message.name = "other";
  EXPECT_THAT(all<Register>(present(message, there)), SizeIs(1));
}

}  // namespace
}  // namespace millrace::services::lcm

namespace millrace::fabric::lcm {
namespace {

using namespace std::string_literals;
using observer::Entry;
using observer::Withdrawal;
using testing::HasSubstr;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const InstanceId instance = InstanceId::parse("0d7e3b1c-6f0c-4c39-8a55-0a2d9f4b7c66").value();

Time time(std::int64_t nanoseconds) {
  return Time(std::chrono::nanoseconds(nanoseconds));
}

Entry request() {
  return {.at = time(1'000'000'007),
          .uuid = uuid,
          .sample = Request{.key = {"cnc", 2},
                            .call = {0xFFFF'0000'1234'5678, 17},
                            .attempt = 3,
                            .assigned = instance,
                            .succeeds = 0xFFFF'FFFF'FFFF'FFFF,
                            .uuid = uuid,
                            .text = "Ma\xDF\x81 1",
                            .state = 0xFFFF'FFFF,
                            .deadline = time(9),
                            .seen = time(8),
                            .dispatched = time(7),
                            .may_wait = true,
                            .replayed = true}};
}

Entry reply() {
  return {.at = time(5),
          .uuid = uuid,
          .sample = Reply{.key = {"cnc", 2},
                          .instance = instance,
                          .call = {5, 17},
                          .attempt = 2,
                          .kind = ReplyKind::declined,
                          .code = ServiceCode::refused,
                          .text = "no\0room"s,
                          .state = 7,
                          .received = time(1),
                          .started = time(2),
                          .answered = time(3),
                          .replayed = false}};
}

Entry event() {
  return {.at = time(6),
          .uuid = uuid,
          .withheld = 12,
          .sample = Event{.key = {"cnc", 2},
                          .call = {5, 17},
                          .attempt = 2,
                          .kind = EventKind::held,
                          .at = time(4),
                          .instance = instance,
                          .uuid = uuid,
                          .text = "",
                          .state = 7,
                          .detail = "it is gone",
                          .replayed = true}};
}

/// Encodes and decodes an entry.
Entry through(const Entry& entry, const std::string& channel) {
  const auto message = mirrored(entry);
  EXPECT_EQ(message.value().channel, "MILLRACE_MIRROR." + channel);
  EXPECT_TRUE(is_mirror(message->channel));
  auto back = entry_of(message->channel, message->bytes);
  EXPECT_TRUE(back) << back.error();
  return back.value_or(Entry{});
}

TEST(Mirror, ShowsARequestWhole) {
  const Entry there = request();
  const Entry back = through(there, "request");
  EXPECT_EQ(back.at, there.at);
  EXPECT_EQ(back.uuid, there.uuid);
  EXPECT_EQ(back.withheld, std::nullopt);
  const auto& sut = std::get<Request>(back.sample);
  const auto& was = std::get<Request>(there.sample);
  EXPECT_EQ(sut.key, was.key);
  EXPECT_EQ(sut.call, was.call);
  EXPECT_EQ(sut.attempt, was.attempt);
  EXPECT_EQ(sut.assigned, was.assigned);
  EXPECT_EQ(sut.succeeds, was.succeeds);
  EXPECT_EQ(sut.uuid, was.uuid);
  EXPECT_EQ(sut.text, was.text);
  EXPECT_EQ(sut.state, was.state);
  EXPECT_EQ(sut.deadline, was.deadline);
  EXPECT_EQ(sut.seen, was.seen);
  EXPECT_EQ(sut.dispatched, was.dispatched);
  EXPECT_TRUE(sut.may_wait);
  EXPECT_TRUE(sut.replayed);
}

TEST(Mirror, ShowsAReplyWholeWithItsNul) {
  const Entry back = through(reply(), "reply");
  EXPECT_EQ(back.uuid, uuid);
  const auto& sut = std::get<Reply>(back.sample);
  EXPECT_EQ(sut.instance, instance);
  EXPECT_EQ(sut.kind, ReplyKind::declined);
  EXPECT_EQ(sut.code, ServiceCode::refused);
  EXPECT_EQ(sut.text, "no\0room"s);
  EXPECT_EQ(sut.received, time(1));
  EXPECT_EQ(sut.started, time(2));
  EXPECT_EQ(sut.answered, time(3));
}

TEST(Mirror, ShowsAnEventWithoutTheTextThatIsWithheld) {
  const Entry back = through(event(), "event");
  EXPECT_EQ(back.withheld, 12U);
  const auto& sut = std::get<Event>(back.sample);
  EXPECT_EQ(sut.kind, EventKind::held);
  EXPECT_EQ(sut.at, time(4));
  EXPECT_EQ(sut.detail, "it is gone");
  EXPECT_TRUE(sut.replayed);
}

TEST(Mirror, ShowsAWithdrawal) {
  const Entry there{
      .at = time(6), .uuid = uuid, .sample = Withdrawal{{"cnc", 2}, {5, 17}, instance}};
  const Entry back = through(there, "withdrawal");
  const auto& sut = std::get<Withdrawal>(back.sample);
  EXPECT_EQ(sut.key, (ChannelKey{"cnc", 2}));
  EXPECT_EQ(sut.call, (CallId{5, 17}));
  EXPECT_EQ(sut.instance, instance);
}

TEST(Mirror, ShowsCallsAndEventsOnly) {
  EXPECT_FALSE(mirrored({.sample = ChannelStatus{}}));
  EXPECT_FALSE(mirrored({.sample = MachineStatus{}}));
}

TEST(Mirror, RefusesWhatNoFabricCanHaveSent) {
  const auto why = [](auto change) {
    mirror_request_t message{};
    message.machine = "cnc";
    message.channel = 1;
    message.call = "5-17";
    message.instance = instance.to_string();
    message.succeeds = "0";
    change(message);
    const auto sut = entry_of("MILLRACE_MIRROR.request", encode(message));
    return sut ? "" : sut.error();
  };
  EXPECT_EQ(why([](auto&) {}), "");
  EXPECT_EQ(why([](auto& m) { m.machine = "call.4349319d"; }), "");
  EXPECT_THAT(why([](auto& m) { m.channel = -1; }), HasSubstr("no channel"));
  EXPECT_THAT(why([](auto& m) { m.machine = std::string(64, 'm'); }), HasSubstr("no channel"));
  EXPECT_THAT(why([](auto& m) { m.call = "17"; }), HasSubstr("no call"));
  EXPECT_THAT(why([](auto& m) { m.instance = "me"; }), HasSubstr("no instance"));
  EXPECT_THAT(why([](auto& m) { m.state = -1; }), HasSubstr("its state is -1"));
  EXPECT_THAT(why([](auto& m) { m.text = "中"; }), HasSubstr("U+4E2D"));
  EXPECT_THAT(entry_of("MILLRACE_MIRROR.request", encode(mirror_event_t{})).error(),
              HasSubstr("another type"));
  EXPECT_FALSE(entry_of("MILLRACE_MIRROR.other", ""));
}

TEST(Mirror, RefusesAnUnknownKindOfEvent) {
  for (const char* word : {"unknown", "dropped", ""}) {
    mirror_event_t message{};
    message.machine = "cnc";
    message.call = "5-17";
    message.instance = instance.to_string();
    message.kind = word;
    EXPECT_EQ(entry_of("MILLRACE_MIRROR.event", encode(message)).error(),
              "its kind of event is not known");
  }
}

}  // namespace
}  // namespace millrace::fabric::lcm
