#include "tests/unit/gateway/core_calls_test.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/channel/answered_requests.hpp"
#include "gateway/core/service_faults.hpp"
#include "gateway/dispatch/near_miss.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;
using channel::AnsweredRequests;

TEST_F(CoreCallsTest, ReadsEachChannelOfANewLink) {
  start();
  EXPECT_THAT(all<Read>(sut->on_link_up("cnc", {1, 2}, now)), SizeIs(2));
}

TEST_F(CoreCallsTest, DispatchesARequestToTheInstanceThatServesIt) {
  start_with(instance(1));
  const auto published = all<Publish>(confirm(request(1)));
  ASSERT_THAT(published, SizeIs(1));
  EXPECT_EQ(published.front().request.assigned, instance(1).id);
  EXPECT_EQ(published.front().request.call, (fabric::CallId{7, 1001}));
}

TEST_F(CoreCallsTest, ReservesCallNumbersWhenALinkComesUp) {
  start();
  const auto records = all<Record>(sut->on_link_up("cnc", {1, 2}, now));
  ASSERT_THAT(records, SizeIs(1));
  EXPECT_EQ(records[0].entry, JournalEntry(NumbersEntry{7, 2000}));
}

// A regression: on a full disk a number was used that the journal did not hold; after a power cut
// it was used again. Found by the simulation.
TEST_F(CoreCallsTest, AcceptsNoCallBeforeTheJournalHoldsItsNumber) {
  start();
  const auto up = sut->on_link_up("cnc", {1, 2}, now);
  sut->on_instance_ready(instance(1), now);
  const auto left = all<EmitEvent>(request(1));
  ASSERT_THAT(left, SizeIs(1));
  EXPECT_THAT(left.front().event.detail, HasSubstr("call numbers"));
  EXPECT_THAT(all<Read>(confirm(up)), SizeIs(1)) << "the request is read once more";
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

// A regression: another channel's request was accepted although no service had its UUID. Found by
// the simulation.
TEST_F(CoreCallsTest, DoesNotCountAnInstanceThatOnlyTheJournalHas) {
  DispatchedEntry dispatched;
  dispatched.call = {7, 1};
  dispatched.key = {"cnc", 1};
  dispatched.request = {uuid, "2", 1};
  dispatched.instance = instance(1).id;
  journal_state.apply(dispatched);
  start();
  link_up();
  sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 1, 0, ""}, now);
  const auto left = all<EmitEvent>(request(2));
  ASSERT_THAT(left, SizeIs(1));
  EXPECT_EQ(left.front().event.kind, fabric::EventKind::unserved);
}

TEST_F(CoreCallsTest, ReservesTheNextCallNumbersWhenHalfAreUsed) {
  start_with(instance(1));
  std::vector<NumbersEntry> reserved;
  for (std::uint32_t call = 1; call <= 600; ++call) {
    const auto actions = request(1, uuid, call);
    for (const Record& record : all<Record>(actions)) {
      if (const auto* numbers = std::get_if<NumbersEntry>(&record.entry)) {
        reserved.push_back(*numbers);
      }
    }
    confirm(actions);
    // The program sends another request.
    sut->on_time(now);
    sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", call + 1, 0, ""}, now);
  }
  EXPECT_THAT(reserved, ElementsAre(NumbersEntry{7, 3000}));
}

TEST_F(CoreCallsTest, AcceptsALeftRequestWhenAnInstanceAppears) {
  start();
  link_up();
  EXPECT_THAT(all<EmitEvent>(request(1)), SizeIs(1));
  EXPECT_THAT(all<Read>(sut->on_instance_ready(instance(1), now)), SizeIs(1));
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

TEST_F(CoreCallsTest, DispatchesTheNextCallToAnInstanceAsSoonAsItHasAnswered) {
  start_with(instance(1));
  const auto first = all<Publish>(confirm(request(1)));
  EXPECT_THAT(all<Publish>(confirm(request(2))), IsEmpty());
  const fabric::Reply reply = answer_to(first.front().request);
  EXPECT_THAT(all<Publish>(confirm(sut->on_reply(reply, now))), SizeIs(1));
}

// A tool that finds the gateway gone knows from it what a restart means for the calls.
TEST_F(CoreCallsTest, SaysWithItsMachineWhetherTheJournalIsKept) {
  start_with(instance(1));
  EXPECT_EQ(sut->machine_status().journal, fabric::JournalState::kept);
  sut->on_journal_error("the disk is full", now);
  EXPECT_EQ(sut->machine_status().journal, fabric::JournalState::not_writable);
  sut->on_journal_error("", now);
  EXPECT_EQ(sut->machine_status().journal, fabric::JournalState::kept);
}

TEST_F(CoreCallsTest, AcceptsNothingWhileTheJournalIsFull) {
  start_with(instance(1));
  sut->on_journal_error("the disk is full", now);
  const auto actions = request(1);
  EXPECT_THAT(all<Record>(actions), IsEmpty());
  ASSERT_THAT(all<PublishStatus>(actions), SizeIs(1));
  EXPECT_EQ(all<PublishStatus>(actions).front().status.reason, "the disk is full");
  EXPECT_THAT(all<Read>(sut->on_journal_error("", now)), SizeIs(1));
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

TEST_F(CoreCallsTest, ReportsThatACallWaitsForTheJournalUntilItDoesNot) {
  start_with(instance(1));
  const auto assigned = request(1);
  const auto shown =
      all<PublishStatus>(sut->on_journal_error("the journal cannot be written", now));
  ASSERT_THAT(shown, SizeIs(1));
  EXPECT_EQ(shown.front().status.state, fabric::ChannelState::running);
  EXPECT_EQ(shown.front().status.reason, "the journal cannot be written");
  const auto well = all<PublishStatus>(sut->on_journal_error("", now));
  ASSERT_THAT(well, SizeIs(1));
  EXPECT_EQ(well.front().status.reason, "");
  EXPECT_THAT(all<Publish>(confirm(assigned)), SizeIs(1));
}

TEST_F(CoreCallsTest, LeavesACallThatItsInstanceRunsAsItIsWhileTheJournalIsFull) {
  start_with(instance(1));
  const auto published = all<Publish>(confirm(request(1)));
  ASSERT_THAT(published, SizeIs(1));
  EXPECT_THAT(all<PublishStatus>(sut->on_journal_error("the journal cannot be written", now)),
              IsEmpty());
  const auto answered =
      all<PublishStatus>(sut->on_reply(answer_to(published.front().request), now));
  ASSERT_FALSE(answered.empty());
  EXPECT_EQ(answered.back().status.reason, "the journal cannot be written");
}

TEST_F(CoreCallsTest, ResumesTheCallsOfAnEarlierRunAtTheirInstance) {
  start_with(instance(1));
  confirm(request(1));
  start();
  sut->on_instance_ready(instance(1), now);
  link_up();
  const auto published =
      all<Publish>(sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 1, 0, ""}, now));
  ASSERT_THAT(published, SizeIs(1));
  EXPECT_EQ(published.front().request.call, (fabric::CallId{7, 1001}));
  EXPECT_EQ(published.front().request.attempt, 1U);
}

TEST_F(CoreCallsTest, IgnoresRepliesForChannelsOfOthers) {
  start();
  link_up();
  fabric::Reply reply;
  reply.key = {"other", 1};
  EXPECT_THAT(sut->on_reply(reply, now), IsEmpty());
  EXPECT_FALSE(sut->serves({"other", 1}));
}

TEST_F(CoreCallsTest, AnswersAnUnservedRequestOnlyWhereATimeIsConfigured) {
  start({.everywhere = {.unserved = Rule{5s, 901}}});
  link_up();
  request(1);
  now.steady += 5s;
  sut->on_time(now);
  const auto actions = request(1);
  const auto records = all<Record>(actions);
  const auto answered = std::ranges::find_if(records, [](const Record& record) {
    return std::holds_alternative<AnsweredEntry>(record.entry);
  });
  ASSERT_NE(answered, records.end());
  EXPECT_EQ(std::get<AnsweredEntry>(answered->entry).answer.state, 901U);
  EXPECT_THAT(all<Read>(confirm(actions)), SizeIs(1));
}

// The answer of the gateway needs a number, too.
TEST_F(CoreCallsTest, AnswersAnUnservedRequestOnlyOnceTheJournalHasItsNumber) {
  start({.everywhere = {.unserved = Rule{5s, 901}}});
  const auto up = sut->on_link_up("cnc", {1, 2}, now);
  request(1);
  now.steady += 5s;
  sut->on_time(now);
  const auto has_answer = [](const Actions& actions) {
    const auto records = all<Record>(actions);
    return std::ranges::any_of(records, [](const Record& record) {
      return std::holds_alternative<AnsweredEntry>(record.entry);
    });
  };
  EXPECT_FALSE(has_answer(request(1)));
  confirm(up);
  EXPECT_TRUE(has_answer(request(1)));
}

TEST_F(CoreCallsTest, LetsAnOperatorAnswerThePendingCallOnly) {
  start();
  link_up();
  core::CommandResult result;
  const fabric::ChannelKey key{"cnc", 1};
  sut->on_answer(key, {7, 1001}, {"go on", 7, "ann"}, result, now);
  EXPECT_FALSE(result.done);
  EXPECT_EQ(result.detail, "no call is pending on this channel");
  sut->on_instance_ready(instance(1), now);
  confirm(request(1));
  sut->on_answer(key, {7, 1000}, {"go on", 7, "ann"}, result, now);
  EXPECT_EQ(result.detail, "the channel has another call now: 7-1001");
  const auto actions = sut->on_answer(key, {7, 1001}, {"go on", 7, "ann"}, result, now);
  EXPECT_TRUE(result.done);
  EXPECT_THAT(all<Record>(actions), SizeIs(1));
  sut->on_answer(key, {7, 1001}, {"go on", 7, "ann"}, result, now);
  EXPECT_EQ(result.detail, "the call's response is being written");
}

TEST_F(CoreCallsTest, ExplainsToAnOperatorThatARequestIsNotAccepted) {
  start();
  link_up();
  request(1);
  core::CommandResult result;
  sut->on_retry({"cnc", 1}, {}, "ann", result, now);
  EXPECT_FALSE(result.done);
  EXPECT_THAT(result.detail,
              testing::HasSubstr("does not accept this request, so there is no call to act on"));
  EXPECT_THAT(result.detail, testing::HasSubstr("no service has the UUID"));
}

// A regression: the status showed for ever that its instances were draining.
TEST_F(CoreCallsTest, ReportsTheNewReasonWhenTheLastInstanceOfARequestIsGone) {
  start();
  link_up();
  auto draining = instance(1);
  draining.draining = true;
  sut->on_instance_ready(draining, now);
  const auto shown = all<PublishStatus>(request(1));
  ASSERT_FALSE(shown.empty());
  EXPECT_THAT(shown.back().status.reason, testing::HasSubstr("draining"));
  sut->on_instance_gone(draining.id, now);
  now.steady += 2s;
  EXPECT_THAT(all<Read>(sut->on_time(now)), SizeIs(1)) << "the request is read again";
  const auto again = all<PublishStatus>(request(1));
  ASSERT_FALSE(again.empty());
  EXPECT_THAT(again.back().status.reason, testing::HasSubstr("no instance serves"));
}

TEST_F(CoreCallsTest, LetsAnOperatorRetryABlockedCall) {
  const auto once = at_most_once(1);
  start_with(once);
  confirm(request(1));
  sut->on_instance_ready(instance(2), now);
  sut->on_instance_gone(once.id, now);
  now.steady += 2s;
  EXPECT_THAT(all<Publish>(confirm(sut->on_time(now))), IsEmpty());
  core::CommandResult result;
  const auto actions = sut->on_retry({"cnc", 1}, {7, 1001}, "ann", result, now);
  EXPECT_TRUE(result.done);
  const auto published = all<Publish>(confirm(actions));
  ASSERT_THAT(published, SizeIs(1));
  EXPECT_EQ(published.front().request.assigned, instance(2).id);
  EXPECT_EQ(published.front().request.attempt, 2U);
}

TEST_F(CoreCallsTest, RefusesToRetryACallThatNoInstanceCanRun) {
  const auto once = at_most_once(1);
  start_with(once);
  confirm(request(1));
  sut->on_instance_gone(once.id, now);
  now.steady += 2s;
  confirm(sut->on_time(now));
  core::CommandResult result;
  EXPECT_THAT(sut->on_retry({"cnc", 1}, {7, 1001}, "ann", result, now), IsEmpty());
  EXPECT_FALSE(result.done);
  EXPECT_THAT(result.detail, testing::HasSubstr("no instance serves"));
  EXPECT_THAT(result.detail, testing::HasSubstr("start the service, then retry"));
  sut->on_instance_ready(instance(2), now);
  const auto actions = sut->on_retry({"cnc", 1}, {7, 1001}, "ann", result, now);
  EXPECT_TRUE(result.done);
  EXPECT_THAT(all<Publish>(confirm(actions)), SizeIs(1));
}

TEST_F(CoreCallsTest, KeepsTimeAndReasonOfABlockedCallOverARestart) {
  start();
  link_up();
  lose_instance_of_a_call();
  now.steady += 2s;
  const auto actions = sut->on_time(now);
  const auto held = all<PublishStatus>(actions);
  ASSERT_FALSE(held.empty());
  ASSERT_EQ(held.back().status.state, fabric::ChannelState::held);
  const fabric::ChannelStatus before = held.back().status;
  EXPECT_THAT(before.reason, testing::HasSubstr("marker"));
  confirm(actions);

  start();
  now.wall += std::chrono::minutes(8);
  now.steady += std::chrono::minutes(8);
  link_up();
  std::vector<PublishStatus> shown;
  const auto take = [&](const Actions& done) {
    std::ranges::copy(all<PublishStatus>(done), std::back_inserter(shown));
    std::ranges::copy(all<PublishStatus>(confirm(done)), std::back_inserter(shown));
  };
  take(sut->on_read({"cnc", 1}, {ReadSet::state, "", "", 1, 0, ""}, now));
  take(sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 1, 0, ""}, now));
  while (sut->next_time()) {
    now.steady = std::max(now.steady, *sut->next_time());
    take(sut->on_time(now));
  }
  ASSERT_FALSE(shown.empty());
  EXPECT_EQ(shown.back().status.state, fabric::ChannelState::held);
  EXPECT_EQ(shown.back().status.since, before.since);
  EXPECT_EQ(shown.back().status.reason, before.reason);
}

TEST_F(CoreCallsTest, ShowsThatABlockedCallIsHeldTooLong) {
  Policies policies;
  policies.everywhere.lost = Rule{4s, 0};
  start(policies);
  link_up();
  lose_instance_of_a_call();
  std::vector<std::string> codes;
  const auto take = [&](const Actions& actions) {
    auto shown = all<PublishStatus>(actions);
    std::ranges::copy(all<PublishStatus>(confirm(actions)), std::back_inserter(shown));
    for (const PublishStatus& publish_status : shown) {
      codes.push_back(publish_status.status.reason.code);
      EXPECT_THAT(publish_status.status.reason.text, testing::HasSubstr("marker"));
    }
  };
  for (int second = 0; second < 8; ++second) {
    now.steady += 1s;
    take(sut->on_time(now));
    take(sut->on_read({"cnc", 1}, {ReadSet::state, "", "", 1, 0, ""}, now));
  }
  EXPECT_THAT(codes, ElementsAre("instance_lost_held", "held_too_long"));
}

TEST_F(CoreCallsTest, KeepsTheTimeOfAnUnservedRequestOverARestart) {
  start();
  link_up();
  const auto left = request(1);
  const fabric::Time since = all<PublishStatus>(left).back().status.since;
  confirm(left);
  start();
  now.wall += std::chrono::minutes(8);
  now.steady += std::chrono::minutes(8);
  link_up();
  EXPECT_EQ(all<PublishStatus>(request(1)).back().status.since, since);
  // A request that was withdrawn and rewritten is a new one.
  confirm(sut->on_read({"cnc", 1}, {ReadSet::state, "", "", 0, 0, ""}, now));
  EXPECT_THAT(journal_state.blocked(), IsEmpty());
  EXPECT_EQ(all<PublishStatus>(request(1)).back().status.since, now.wall);
}

// A regression: above a thousand calls a second Cyclone could not free the remains of each
// withdrawal, and the gateway's memory grew without limit. Found by the long run.
TEST_F(CoreCallsTest, WithdrawsAnAnsweredRequestOnlyWhenItsChannelIsQuiet) {
  start_with(instance(1));
  EXPECT_THAT(all<Withdraw>(answered_call(1)), IsEmpty());
  now.steady += 900ms;
  EXPECT_THAT(all<Withdraw>(answered_call(1)), IsEmpty());
  now.steady += 100ms;
  EXPECT_THAT(all<Withdraw>(sut->on_time(now)), IsEmpty());
  ASSERT_TRUE(sut->next_time());
  now.steady = *sut->next_time();
  EXPECT_THAT(all<Withdraw>(sut->on_time(now)), ElementsAre(Withdraw{instance(1).id, 7}));
  EXPECT_EQ(sut->next_time(), std::nullopt);
}

TEST_F(CoreCallsTest, WithdrawsAnsweredRequestsWhenTheGatewayEnds) {
  start_with(instance(1));
  answered_call(1);
  EXPECT_THAT(all<Withdraw>(sut->end(now)), SizeIs(1));
  EXPECT_THAT(sut->end(now), IsEmpty());
}

TEST_F(CoreCallsTest, WithdrawsAnAnsweredRequestBeforeItReleasesTheChannel) {
  start_with(instance(1));
  answered_call(1);
  const auto actions = sut->drain({"cnc", 1}, now);
  EXPECT_THAT(all<Withdraw>(actions), SizeIs(1));
  EXPECT_THAT(all<RetractStatus>(actions), SizeIs(1));
}

const std::string served = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

TEST(ExplainUnserved, NamesTheCharacterThatIsMissingInTheVendorsOwnSample) {
  EXPECT_EQ(dispatch::explain_unserved("560AACBF-6335-44a9-895A-B27F3ED5E47", {served}),
            "no service has the UUID 560AACBF-6335-44a9-895A-B27F3ED5E47; did you mean "
            "560aacbf-6335-44a9-895a-8b27f3ed5e47, one character is missing; it is malformed: 35 "
            "characters, a UUID has 36");
}

TEST(ExplainUnserved, CountsWhatElseIsDifferent) {
  EXPECT_THAT(dispatch::explain_unserved("660AACBF-6335-44a9-895A-8B27F3ED5E47", {served}),
              testing::EndsWith("5e47, one character differs"));
  EXPECT_THAT(dispatch::explain_unserved("660AACBF-6335-44a9-895A-8B27F3ED5E48", {served}),
              testing::EndsWith("5e47, 2 characters differ"));
  EXPECT_THAT(dispatch::explain_unserved("560AACBF-6335-44a9-895A-8B27F3ED5E477", {served}),
              testing::HasSubstr("5e47, one character is too many"));
}

TEST(ExplainUnserved, MakesNoGuessThatIsFarOff) {
  EXPECT_EQ(dispatch::explain_unserved("11111111-1111-1111-1111-111111111111", {served}),
            "no service has the UUID 11111111-1111-1111-1111-111111111111");
}

TEST(ExplainUnserved, PrefersTheNearest) {
  const std::string nearest = "560aacbf-6335-44a9-895a-8b27f3ed5e4f";
  EXPECT_THAT(
      dispatch::explain_unserved("560aacbf-6335-44a9-895a-8b27f3ed5e4", {nearest, served, nearest}),
      testing::HasSubstr("did you mean 560aacbf-6335-44a9-895a-8b27f3ed5e4f"));
}

TEST(ExplainUnserved, ReportsAnEmptyUuid) {
  EXPECT_THAT(dispatch::explain_unserved("", {served}),
              testing::StartsWith("V.G.SERVICE.UUID is empty"));
}

TEST(ExplainUnserved, KeepsAnIdentifierThatIsNoUuid) {
  EXPECT_EQ(dispatch::explain_unserved("square_root", {served}),
            "no service has the UUID square_root");
}

TEST(Malformed, NamesWhatIsWrong) {
  EXPECT_EQ(dispatch::malformed(served), "");
  EXPECT_EQ(dispatch::malformed("{560AACBF-6335-44a9-895A-8B27F3ED5E47}"), "");
  EXPECT_EQ(dispatch::malformed("560aacbf-6335-44a9-895a-8b27f3ed5e4g"),
            "'g' is not a hexadecimal digit");
  EXPECT_EQ(dispatch::malformed("560aacbf-633-544a9-895a-8b27f3ed5e47"),
            "its dashes are in the wrong places");
}

fabric::RequestKey request(std::uint16_t channel, std::uint8_t instance = 1) {
  fabric::RequestKey key{{"cnc", channel}, 7, {}};
  key.instance.bytes.fill(instance);
  return key;
}

class AnsweredRequestsTest : public testing::Test {
 protected:
  AnsweredRequests sut;
  SteadyTime now{1h};
};

TEST_F(AnsweredRequestsTest, WithdrawsARequestOnceItHasBeenQuiet) {
  sut.add(request(1), now);
  ASSERT_EQ(sut.next_time(), now + AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet - 1ms), IsEmpty());
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1)));
  EXPECT_EQ(sut.next_time(), std::nullopt);
}

TEST_F(AnsweredRequestsTest, WithdrawsNoRequestThatTheNextOneReplaces) {
  sut.add(request(1), now);
  sut.replace(request(1));
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), IsEmpty());
}

TEST_F(AnsweredRequestsTest, KeepsTheRequestOfAnotherInstanceOfTheSameChannel) {
  sut.add(request(1, 1), now);
  sut.add(request(1, 2), now);
  sut.replace(request(1, 2));
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1, 1)));
}

TEST_F(AnsweredRequestsTest, WithdrawsEachRequestAfterItsOwnQuietTime) {
  sut.add(request(1), now);
  sut.add(request(2), now + 500ms);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), ElementsAre(request(1)));
  ASSERT_EQ(sut.next_time(), now + 500ms + AnsweredRequests::quiet);
  EXPECT_THAT(sut.due(*sut.next_time()), ElementsAre(request(2)));
}

TEST_F(AnsweredRequestsTest, CountsTheQuietFromTheLastAnswer) {
  sut.add(request(1), now);
  sut.add(request(1), now + 900ms);
  EXPECT_THAT(sut.due(now + AnsweredRequests::quiet), IsEmpty());
  EXPECT_THAT(sut.due(now + 900ms + AnsweredRequests::quiet), SizeIs(1));
}

TEST_F(AnsweredRequestsTest, LimitsTheWithdrawalsAtOnce) {
  for (std::uint16_t channel = 1; channel <= AnsweredRequests::at_once + 1; ++channel) {
    sut.add(request(channel), now);
  }
  const SteadyTime first = now + AnsweredRequests::quiet;
  EXPECT_THAT(sut.due(first), SizeIs(AnsweredRequests::at_once));
  ASSERT_EQ(sut.next_time(), first + AnsweredRequests::pause);
  EXPECT_THAT(sut.due(*sut.next_time()), SizeIs(1));
}

TEST_F(AnsweredRequestsTest, GivesUpAllOfAChannel) {
  sut.add(request(1, 1), now);
  sut.add(request(1, 2), now);
  sut.add(request(2, 1), now);
  EXPECT_THAT(sut.take({"cnc", 1}), ElementsAre(request(1, 1), request(1, 2)));
  EXPECT_THAT(sut.take_all(), ElementsAre(request(2, 1)));
}

}  // namespace
}  // namespace millrace::gateway

namespace millrace::gateway::core {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

fabric::InstanceIdentity instance(std::uint8_t number) {
  fabric::InstanceIdentity identity;
  identity.id.bytes.fill(number);
  identity.uuid = "weather";
  identity.name = "w" + std::to_string(number);
  return identity;
}

SteadyTime after(std::chrono::seconds time) {
  return SteadyTime(time);
}

TEST(LostServices, NameTheLastInstanceOfAServiceUntilAnotherOneComes) {
  LostServices sut;
  EXPECT_FALSE(sut.on_ready(instance(1)));
  EXPECT_FALSE(sut.on_ready(instance(2)));
  EXPECT_FALSE(sut.on_gone(instance(1).id, after(std::chrono::seconds(1))));
  const auto lost = sut.on_gone(instance(2).id, after(std::chrono::seconds(2)));
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->uuid, "weather");
  EXPECT_EQ(lost->name, "w2");
  EXPECT_TRUE(sut.on_ready(instance(3)));
  EXPECT_FALSE(sut.on_ready(instance(3)));
}

TEST(LostServices, HaveNoneThatLeftInOrderOrWasNeverThere) {
  LostServices sut;
  auto draining = instance(1);
  sut.on_ready(draining);
  draining.draining = true;
  sut.on_ready(draining);
  EXPECT_FALSE(sut.on_gone(draining.id, after(std::chrono::seconds(1))));
  EXPECT_FALSE(sut.on_gone(instance(9).id, after(std::chrono::seconds(1))));
}

TEST(LostServices, AreForgottenAfterAQuarterOfAnHour) {
  LostServices sut;
  sut.on_ready(instance(1));
  ASSERT_TRUE(sut.on_gone(instance(1).id, after(std::chrono::seconds(0))));
  EXPECT_THAT(sut.on_time(after(LostServices::kept - std::chrono::seconds(1))), IsEmpty());
  EXPECT_THAT(sut.on_time(after(LostServices::kept)), ElementsAre("weather"));
  EXPECT_FALSE(sut.on_ready(instance(2)));
}

}  // namespace
}  // namespace millrace::gateway::core
