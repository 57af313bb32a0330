#include "tools/recording/call.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>

#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using std::chrono_literals::operator""us;
using tests::at;
using tests::one_call;

/// The result of `follower` for the last of `entries`; the others must end no call.
std::optional<Call> feed(CallFollower& follower, const std::vector<Entry>& entries) {
  std::optional<Call> last;
  for (const Entry& entry : entries) {
    EXPECT_FALSE(last);
    last = follower.add(entry);
  }
  return last;
}

Entry ready(const std::string& name) {
  InstanceNews news{.change = Change::ready, .identity = {}};
  news.identity.id.bytes.fill(0x11);
  news.identity.name = name;
  news.identity.host = "hall";
  return {.at = at(0), .sample = news};
}

std::vector<Entry> until_written(std::vector<Entry> entries) {
  entries.resize(6);
  return entries;
}

TEST(ACallFollower, ReportsACallWhenItsResponseIsWritten) {
  CallFollower sut;
  const auto call = feed(sut, until_written(one_call(17, 0)));
  ASSERT_TRUE(call);
  EXPECT_EQ(call->id.to_string(), "5f-17");
  EXPECT_EQ(call->first(Stage::seen)->text, "2");
  EXPECT_EQ(call->end()->text, "1.414214");
  EXPECT_EQ(call->end()->state, 1U);
  EXPECT_EQ(call->attempt(), 1U);
  EXPECT_EQ(call->duration(), 7100us);
  EXPECT_TRUE(sut.under_way().empty());
}

TEST(ACallFollower, ShowsTheCallThatIsUnderWay) {
  CallFollower sut;
  const auto entries = one_call(17, 0);
  EXPECT_FALSE(sut.add(entries[0]));
  EXPECT_FALSE(sut.add(entries[2]));
  ASSERT_EQ(sut.under_way().size(), 1U);
  EXPECT_EQ(sut.under_way().begin()->second.newest()->stage, Stage::dispatched);
}

TEST(ACallFollower, HasNoRequestAndNoTimeOfAPartlySeenCall) {
  CallFollower sut;
  const auto call = sut.add(one_call(17, 0)[5]);
  ASSERT_TRUE(call);
  EXPECT_EQ(call->first(Stage::seen), nullptr);
  EXPECT_EQ(call->duration(), std::nullopt);
}

TEST(ACallFollower, ReportsAWithdrawnCall) {
  CallFollower sut;
  auto entries = until_written(one_call(17, 0));
  auto& event = std::get<fabric::Event>(entries.back().sample);
  event.kind = fabric::EventKind::withdrawn;
  event.text.clear();
  const auto call = feed(sut, entries);
  ASSERT_TRUE(call);
  EXPECT_EQ(call->outcome(), Outcome::withdrawn);
  EXPECT_EQ(call->first(Stage::written), nullptr);
}

TEST(ACallFollower, ForgetsACallWhoseEndItMissed) {
  CallFollower sut;
  sut.add(one_call(17, 0)[0]);
  const auto call = feed(sut, until_written(one_call(18, 100)));
  ASSERT_TRUE(call);
  EXPECT_EQ(call->id.number, 18U);
  EXPECT_EQ(call->first(Stage::seen)->at, at(100));
  EXPECT_TRUE(sut.under_way().empty());
}

TEST(ACallFollower, CountsAnUnservedRequestAsNoCall) {
  CallFollower sut;
  EXPECT_FALSE(sut.add({.sample = fabric::Event{.kind = fabric::EventKind::unserved}}));
  EXPECT_TRUE(sut.under_way().empty());
}

/// The calls that become complete with these entries.
std::vector<Call> collect(CallCollector& collector, const std::vector<Entry>& entries) {
  std::vector<Call> all;
  for (const Entry& entry : entries) {
    for (Call& call : collector.add(entry)) {
      all.push_back(std::move(call));
    }
  }
  return all;
}

TEST(ACallCollector, HasACallOnceInAnyOrderOfItsSamples) {
  const std::vector<Entry> entries = one_call(17, 0);
  // Request, reply and the three events with their own times.
  std::vector<std::size_t> order{0, 1, 3, 4, 5};
  do {
    CallCollector sut(Call::Texts::kept);
    std::vector<Entry> shuffled;
    for (const std::size_t i : order) {
      shuffled.push_back(entries[i]);
    }
    std::vector<Call> calls = collect(sut, shuffled);
    for (Call& call : sut.close()) {
      calls.push_back(std::move(call));
    }
    ASSERT_EQ(calls.size(), 1U);
    ASSERT_EQ(calls.front().outcome(), Outcome::answered);
    ASSERT_EQ(calls.front().end()->text, "1.414214");
    ASSERT_EQ(calls.front().duration(), 7100us);
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(ACallCollector, DoesNotReportACallAgainWhoseLastStepIsRepeated) {
  CallCollector sut(Call::Texts::kept);
  std::vector<Entry> entries = one_call(17, 0);
  const Entry written = entries[5];
  ASSERT_EQ(collect(sut, entries).size(), 1U);
  EXPECT_TRUE(sut.add(written).empty());
  EXPECT_TRUE(sut.close().empty());
}

TEST(ACallCollector, ReportsCallsThatAreUnderWayAtTheEnd) {
  CallCollector sut(Call::Texts::left_out);
  for (const std::uint64_t number : {18U, 17U}) {
    EXPECT_TRUE(sut.add(one_call(number, 0)[1]).empty());
  }
  const std::vector<Call> calls = sut.close();
  ASSERT_EQ(calls.size(), 2U);
  EXPECT_EQ(calls.front().id.number, 18U) << "in the order of their first entries";
  EXPECT_EQ(calls.front().outcome(), Outcome::under_way);
  EXPECT_EQ(calls.front().first(Stage::seen)->text, "");
}

TEST(ACallCollector, ReportsTheOldestOfTooManyOpenCalls) {
  CallCollector sut(Call::Texts::kept);
  std::vector<Call> calls;
  for (std::uint64_t number = 1; number <= 4097; ++number) {
    calls = collect(sut, {one_call(number, 0)[1]});
  }
  ASSERT_EQ(calls.size(), 1U);
  EXPECT_EQ(calls.front().id.number, 1U);
}

TEST(InstanceNames, KnowNameAndHostAlsoOnceTheInstanceIsGone) {
  InstanceNames sut;
  sut.add(ready("sq1"));
  Entry gone = ready("");
  auto& news = std::get<InstanceNews>(gone.sample);
  news.change = Change::gone;
  sut.add(gone);
  EXPECT_EQ(sut.of(news.identity.id).name, "sq1");
  EXPECT_EQ(sut.of(news.identity.id).host, "hall");
  EXPECT_EQ(sut.of({{1}}).name, "");
}

Call call_of_all(const std::vector<Entry>& entries) {
  Call call({0x5f, 17});
  for (const Entry& entry : entries) {
    call.add(entry);
  }
  return call;
}

fabric::Event& event_of(Entry& entry) {
  return std::get<fabric::Event>(entry.sample);
}

TEST(ACall, IsUnderWayUntilItsEnd) {
  std::vector<Entry> entries = until_written(one_call(17, 0));
  const Entry written = entries.back();
  entries.pop_back();
  Call sut = call_of_all(entries);
  EXPECT_EQ(sut.outcome(), Outcome::under_way);
  EXPECT_TRUE(sut.add(written));
  EXPECT_EQ(sut.outcome(), Outcome::answered);
}

TEST(ACall, FailedIfTheServiceSaysSoInTheLastAttempt) {
  for (const auto code : {fabric::ServiceCode::failed, fabric::ServiceCode::refused}) {
    std::vector<Entry> entries = one_call(17, 0);
    std::get<fabric::Reply>(entries[3].sample).code = code;
    EXPECT_EQ(call_of_all(entries).outcome(), Outcome::failed);
    event_of(entries[5]).attempt = 2;
    EXPECT_EQ(call_of_all(entries).outcome(), Outcome::answered);
  }
}

TEST(ACall, FailedAlsoIfTheServiceDoesNotCountAttempts) {
  std::vector<Entry> entries = one_call(17, 0);
  auto& reply = std::get<fabric::Reply>(entries[3].sample);
  reply.code = fabric::ServiceCode::failed;
  reply.attempt = 0;
  event_of(entries[5]).attempt = 0;
  EXPECT_EQ(call_of_all(entries).outcome(), Outcome::failed);
}

TEST(ACall, FailedIfTheGatewayHasWrittenAnErrorInPlaceOfARefusedResponse) {
  std::vector<Entry> entries = one_call(17, 0);
  Entry refused = entries[4];
  event_of(refused).kind = fabric::EventKind::refused;
  entries.insert(entries.begin() + 4, refused);
  event_of(entries[6]).text = "ERROR: the service's answer is too long";
  EXPECT_EQ(call_of_all(entries).outcome(), Outcome::failed);
}

TEST(ACall, IsAnsweredByTheResponseOfAServiceWhateverHappenedToItsAttemptBefore) {
  using fabric::EventKind;
  for (const EventKind kind : {EventKind::lost, EventKind::refused, EventKind::held}) {
    std::vector<Entry> entries = one_call(17, 0);
    Entry event = entries[4];
    event_of(event).kind = kind;
    entries.insert(entries.begin() + 4, event);
    EXPECT_EQ(call_of_all(entries).outcome(), Outcome::answered);
  }
}

TEST(ACall, IsHeldWhenItsInstanceIsLostAtTheSameTimeInWhateverOrderBothArrive) {
  using fabric::EventKind;
  for (const auto& order : {std::array{EventKind::lost, EventKind::held},
                            std::array{EventKind::held, EventKind::lost}}) {
    std::vector<Entry> entries = one_call(17, 0);
    Entry event = entries[4];
    entries.resize(3);
    for (const EventKind kind : order) {
      event_of(event).kind = kind;
      entries.push_back(event);
    }
    EXPECT_EQ(call_of_all(entries).newest()->stage, Stage::held);
    // A second attempt at the same time is newer than the loss of the first.
    event_of(event).kind = EventKind::dispatched;
    event_of(event).attempt = 2;
    entries.push_back(event);
    EXPECT_EQ(call_of_all(entries).newest()->stage, Stage::dispatched);
  }
}

TEST(ACall, IsSettledIfTheResponseIsOfNoInstance) {
  std::vector<Entry> entries = one_call(17, 0);
  event_of(entries[5]).instance = {};
  EXPECT_EQ(call_of_all(entries).outcome(), Outcome::settled);
}

TEST(ACall, ShowsADeclinedAttemptAndTheAnswerOfTheNext) {
  std::vector<Entry> entries = one_call(17, 0);
  Entry declined = entries[3];
  auto& reply = std::get<fabric::Reply>(declined.sample);
  reply.kind = fabric::ReplyKind::declined;
  reply.text = "busy";
  std::get<fabric::Reply>(entries[3].sample).attempt = 2;
  event_of(entries[4]).attempt = 2;
  event_of(entries[5]).attempt = 2;
  entries.insert(entries.begin() + 3, declined);
  const Call sut = call_of_all(entries);
  EXPECT_EQ(sut.first(Stage::declined)->attempt, 1U);
  EXPECT_EQ(sut.first(Stage::declined)->detail, "busy");
  EXPECT_EQ(sut.of_attempt(Stage::answered, 1), nullptr);
  EXPECT_EQ(sut.of_attempt(Stage::answered, 2)->text, "1.414214");
  EXPECT_EQ(sut.outcome(), Outcome::answered);
}

TEST(ACall, HasTheUuidOfAReplyWhoseRequestIsMissing) {
  const auto entries = one_call(17, 0);
  const auto reply = std::ranges::find_if(entries, [](const Entry& entry) {
    return std::holds_alternative<fabric::Reply>(entry.sample);
  });
  Call sut;
  sut.id = call_of(*reply);
  ASSERT_TRUE(sut.add(*reply));
  EXPECT_EQ(sut.uuid, tests::square_root);
  // As in a recording that another program has made.
  Entry without_uuid = *reply;
  without_uuid.uuid.clear();
  ASSERT_TRUE(sut.add(without_uuid));
  EXPECT_EQ(sut.uuid, tests::square_root);
}

TEST(ACall, HasNoStepForAnEventOfALaterVersion) {
  std::vector<Entry> entries = one_call(17, 0);
  event_of(entries[4]).kind = static_cast<fabric::EventKind>(200);
  EXPECT_TRUE(call_of_all({entries[4]}).steps.empty());
}

TEST(ACall, IsNotAnsweredByAReplyOfALaterVersion) {
  std::vector<Entry> kind = one_call(17, 0);
  std::get<fabric::Reply>(kind[3].sample).kind = static_cast<fabric::ReplyKind>(200);
  EXPECT_EQ(call_of_all(kind).first(Stage::answered), nullptr);
  std::vector<Entry> code = one_call(17, 0);
  std::get<fabric::Reply>(code[3].sample).code = static_cast<fabric::ServiceCode>(200);
  EXPECT_EQ(call_of_all(code).first(Stage::answered), nullptr);
}

TEST(ACall, EndsOnceAlsoIfAGatewayThatResumesRepeatsIt) {
  std::vector<Entry> entries = one_call(17, 0);
  Entry again = entries[5];
  event_of(again).at = at(5000);
  entries.push_back(again);
  EXPECT_EQ(call_of_all(entries).duration(), 7100us);
}

TEST(ACall, KeepsOneStepOfARepeatedReply) {
  std::vector<Entry> entries = one_call(17, 0);
  entries.push_back(entries[3]);
  EXPECT_EQ(call_of_all(entries).steps.size(), call_of_all(one_call(17, 0)).steps.size());
}

TEST(ACall, NamesAStepByTheEventOfTheGateway) {
  EXPECT_EQ(event_name_of(Stage::seen), "seen");
  EXPECT_EQ(event_name_of(Stage::held), "held");
  EXPECT_EQ(event_name_of(Stage::answered), "");
}

TEST(ACall, LeavesTextsOutIfAsked) {
  Call sut({0x5f, 17}, Call::Texts::left_out);
  for (const Entry& entry : one_call(17, 0)) {
    sut.add(entry);
  }
  EXPECT_EQ(sut.first(Stage::seen)->text, "");
  EXPECT_EQ(sut.end()->text, "");
  EXPECT_EQ(sut.duration(), 7100us);
}

}  // namespace
}  // namespace millrace::tools::recording
