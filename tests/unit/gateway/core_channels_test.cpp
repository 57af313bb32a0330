// Channels that leave, return or are taken over, and policies that change, while calls are under
// way.
#include <gmock/gmock.h>

#include "tests/unit/gateway/core_calls_test.hpp"

namespace millrace::gateway {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using namespace std::chrono_literals;

TEST_F(CoreCallsTest, FinishesTheCallOfAChannelThatLeavesTheConfiguration) {
  start_with(instance(1));
  const auto published = all<Publish>(confirm(request(1)));
  EXPECT_THAT(all<RetractStatus>(sut->drain({"cnc", 1}, now)), IsEmpty());
  const fabric::Reply reply = answer_to(published.front().request);
  EXPECT_THAT(all<Record>(sut->on_reply(reply, now)), SizeIs(1));
  EXPECT_THAT(sut->channels_of("cnc"), ElementsAre(1, 2));
}

TEST_F(CoreCallsTest, ReleasesAnIdleChannelAsSoonAsNothingIsUnderWay) {
  start();
  link_up();
  // The link has begun this read.
  EXPECT_THAT(all<RetractStatus>(sut->drain({"cnc", 2}, now)), IsEmpty());
  EXPECT_THAT(all<RetractStatus>(sut->on_read({"cnc", 2}, {ReadSet::state, "", "", 1, 0, ""}, now)),
              SizeIs(1));
  EXPECT_THAT(sut->channels_of("cnc"), ElementsAre(1));
  EXPECT_THAT(sut->on_time(now), IsEmpty());
}

TEST_F(CoreCallsTest, CountsTheCallsOfAChannelThatHasLeft) {
  start_with(instance(1));
  answered_call(1);
  sut->drain({"cnc", 1}, now);
  ASSERT_THAT(sut->channels_of("cnc"), ElementsAre(2));
  EXPECT_EQ(sut->counts().answered, 1U);
}

TEST_F(CoreCallsTest, DoesNotRememberWhyAChannelThatHasLeftWasBlocked) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  confirm(request(1));
  ASSERT_THAT(journal_state.blocked(), SizeIs(1));
  confirm(sut->not_owner({"cnc", 1}, "served by another gateway", now));
  EXPECT_THAT(journal_state.blocked(), IsEmpty());
}

TEST_F(CoreCallsTest, LeavesTheCallToTheOtherGatewayThatServesTheChannel) {
  start_with(instance(1));
  confirm(request(1));
  const auto actions = sut->not_owner({"cnc", 1}, "served by another gateway", now);
  EXPECT_THAT(all<Withdraw>(actions), SizeIs(1));
  EXPECT_THAT(all<RetractStatus>(actions), SizeIs(1));
  EXPECT_THAT(all<Write>(actions), IsEmpty());
  EXPECT_THAT(sut->channels_of("cnc"), ElementsAre(2));
}

// A regression: the other gateway, which had stood still, saw an idle channel and dispatched the
// call again. Found by the simulation.
TEST_F(CoreCallsTest, ShowsACallUntilTheEndThatItHadDispatchedBeforeItLeftTheChannel) {
  start_with(instance(1));
  confirm(request(1));
  EXPECT_THAT(all<PublishStatus>(sut->not_owner({"cnc", 1}, "served by another gateway", now)),
              IsEmpty());
}

TEST_F(CoreCallsTest, ShowsThatItHasNotDispatchedTheCallThatItLeaves) {
  start();
  link_up();
  auto elsewhere = instance(1);
  elsewhere.concurrency = 1;
  sut->on_instance_ready(elsewhere, now);
  confirm(request(2));
  request(1);
  const auto shown =
      all<PublishStatus>(sut->not_owner({"cnc", 1}, "served by another gateway", now));
  ASSERT_THAT(shown, SizeIs(1));
  EXPECT_EQ(shown.front().status.call, fabric::CallId{});
}

TEST_F(CoreCallsTest, ReportsAtItsEndWhichCallsItHasNotDispatched) {
  start();
  link_up();
  auto identity = instance(1);
  identity.concurrency = 1;
  sut->on_instance_ready(identity, now);
  confirm(request(2));
  request(1);
  const auto actions = sut->end(now);
  ASSERT_THAT(all<PublishStatus>(actions), SizeIs(1));
  EXPECT_EQ(all<PublishStatus>(actions).front().status.key, (fabric::ChannelKey{"cnc", 1}));
  EXPECT_EQ(all<PublishStatus>(actions).front().status.call, fabric::CallId{});
}

TEST_F(CoreCallsTest, WaitsForNoAnswerOfARemovedLink) {
  start();
  link_up();
  EXPECT_THAT(all<RetractStatus>(sut->not_owner({"cnc", 2}, "served by another gateway", now)),
              IsEmpty());
  EXPECT_THAT(all<RetractStatus>(sut->on_link_dropped("cnc", "not wanted", now)), SizeIs(1));
}

TEST_F(CoreCallsTest, FinishesAnAnswerThatHasBegunToReleaseTheProgram) {
  start_with(instance(1));
  confirm(request(1));
  journal_state.apply(AnsweredEntry{{7, 1001}, {instance(1).id, 1, "1.4", 1}});
  journal_state.apply(ClearingEntry{{7, 1001}});
  start();
  EXPECT_THAT(all<RetractStatus>(sut->not_owner({"cnc", 1}, "served by another gateway", now)),
              IsEmpty());
  EXPECT_THAT(all<Read>(sut->on_link_up("cnc", {}, now)), SizeIs(1));
  const ServiceSnapshot unreleased{ReadSet::all, uuid, "2", 0, 0, "1.4"};
  EXPECT_THAT(all<Write>(sut->on_read({"cnc", 1}, unreleased, now)), IsEmpty())
      << "it may have been written just now";
  now.steady += std::chrono::seconds(1);
  EXPECT_THAT(all<Read>(sut->on_time(now)), SizeIs(1));
  EXPECT_THAT(all<Read>(sut->on_read({"cnc", 1}, unreleased, now)), SizeIs(1));
  EXPECT_THAT(all<Write>(sut->on_read({"cnc", 1}, unreleased, now)),
              ElementsAre(Write{Variable::response_state, 1U}));
  EXPECT_THAT(all<RetractStatus>(sut->on_write({"cnc", 1}, WriteOutcome::written, "", now)),
              IsEmpty())
      << "no other gateway would repeat it if it is lost";
  const ServiceSnapshot released{ReadSet::states, "", "", 0, 1, ""};
  EXPECT_THAT(all<RetractStatus>(sut->on_read({"cnc", 1}, released, now)), SizeIs(1));
}

// A regression: the kernel had cleared REQUEST_STATE for an interim state, so the other gateway saw
// no request and the program waited for ever. Found by the simulation.
TEST_F(CoreCallsTest, FinishesACallThatAnotherGatewayCannotSee) {
  start_with(instance(1));
  confirm(request(1));
  journal_state.apply(InterimEntry{{7, 1001}, 1000});
  start();
  EXPECT_THAT(all<RetractStatus>(sut->not_owner({"cnc", 1}, "served by another gateway", now)),
              IsEmpty());
  sut->on_link_up("cnc", {}, now);
  sut->on_instance_ready(instance(1), now);
  const auto seen = sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 0, 1000, ""}, now);
  EXPECT_THAT(all<RetractStatus>(seen), IsEmpty());
  EXPECT_THAT(all<Publish>(seen), SizeIs(1)) << "its instance answers once more";
}

TEST_F(CoreCallsTest, LeavesACallToAnotherGatewayThatCanSeeIt) {
  start_with(instance(1));
  confirm(request(1));
  journal_state.apply(InterimEntry{{7, 1001}, 1000});
  start();
  sut->not_owner({"cnc", 1}, "served by another gateway", now);
  sut->on_link_up("cnc", {}, now);
  const auto seen = sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 1, 1000, ""}, now);
  EXPECT_THAT(all<RetractStatus>(seen), SizeIs(1));
}

// A regression: the call was dispatched before its entry was on a slow disk. Found by the
// simulation.
TEST_F(CoreCallsTest, WaitsForTheEntryOfACallAlsoWhereOneFromBeforeItLeftTheChannelComesLate) {
  start_with(instance(1));
  const auto before = all<Record>(request(1));
  ASSERT_THAT(before, SizeIs(1));
  sut->not_owner({"cnc", 1}, "served by another gateway", now);
  sut->on_link_up("cnc", {1}, now);
  const auto next = request(1);
  EXPECT_THAT(all<Publish>(sut->on_recorded(before.front().ticket, now)), IsEmpty());
  EXPECT_THAT(all<Publish>(confirm(next)), SizeIs(1));
}

TEST_F(CoreCallsTest, ServesAChannelAgainThatWasLeaving) {
  start();
  link_up();
  sut->drain({"cnc", 1}, now);
  sut->on_link_up("cnc", {1, 2}, now);
  sut->on_instance_ready(instance(1), now);
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

TEST_F(CoreCallsTest, BlocksAnAtMostOnceCallThatAnotherGatewayMayHaveDispatched) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f (pid 1 on host7)");
  const auto actions = request(1);
  EXPECT_THAT(all<Publish>(confirm(actions)), IsEmpty());
  ASSERT_THAT(all<PublishStatus>(actions), testing::Not(IsEmpty()));
  EXPECT_EQ(all<PublishStatus>(actions).back().status.state, fabric::ChannelState::held);
  EXPECT_THAT(all<PublishStatus>(actions).back().status.reason,
              HasSubstr("gateway 5f (pid 1 on host7) is gone and may have dispatched this call"));
  core::CommandResult result;
  EXPECT_THAT(all<Publish>(confirm(sut->on_retry({"cnc", 1}, {7, 1001}, "ann", result, now))),
              SizeIs(1));
}

// A regression: with two gateways that did not hear each other, the calls that the first had
// dispatched were forgotten when the second left one of its own. Found by the simulation.
TEST_F(CoreCallsTest, BlocksEachOfSeveralInheritedCallsThatIsStillRequested) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  sut->predecessor_call({"cnc", 1}, "00000000-0000-4000-8000-000000000002", "gateway 60");
  const auto actions = request(1);
  EXPECT_THAT(all<Publish>(confirm(actions)), IsEmpty());
  EXPECT_EQ(all<PublishStatus>(actions).back().status.state, fabric::ChannelState::held);
}

// Found by the simulation.
TEST_F(CoreCallsTest, StillBlocksACallThatItBlockedBeforeItLeftTheChannel) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  confirm(request(1));
  sut->not_owner({"cnc", 1}, "served by another gateway", now);
  link_up();
  const auto actions = request(1);
  EXPECT_THAT(all<Publish>(confirm(actions)), IsEmpty());
  EXPECT_EQ(all<PublishStatus>(actions).back().status.state, fabric::ChannelState::held);
}

TEST_F(CoreCallsTest, WithdrawsItsAnsweredRequestsAlsoWhereAnotherGatewayServesTheChannel) {
  start_with(instance(1));
  answered_call(1);
  answered_call(2);
  EXPECT_THAT(all<Withdraw>(sut->not_owner({"cnc", 1}, "served by another gateway", now)),
              SizeIs(1));
  EXPECT_THAT(all<Withdraw>(sut->on_link_dropped("cnc", "stood still", now)), IsEmpty());
  now.steady += 2 * channel::AnsweredRequests::quiet;
  EXPECT_THAT(all<Withdraw>(sut->on_time(now)), SizeIs(1));
}

// A regression: a gateway that had left a channel to another one, which died before it took it,
// dispatched its own at-most-once call again. Found by the simulation.
TEST_F(CoreCallsTest, BlocksAnAtMostOnceCallThatItHadDispatchedBeforeItLeftTheChannel) {
  start_with(at_most_once(1));
  confirm(request(1));
  sut->not_owner({"cnc", 1}, "served by another gateway", now);
  link_up();
  const auto actions = request(1);
  EXPECT_THAT(all<Publish>(confirm(actions)), IsEmpty());
  ASSERT_THAT(all<PublishStatus>(actions), testing::Not(IsEmpty()));
  EXPECT_EQ(all<PublishStatus>(actions).back().status.state, fabric::ChannelState::held);
}

TEST_F(CoreCallsTest, StillBlocksAnInheritedCallAfterARestart) {
  const auto once = at_most_once(1);
  start_with(once);
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  confirm(request(1));
  start();
  sut->on_instance_ready(once, now);
  link_up();
  sut->on_read({"cnc", 1}, {ReadSet::request, uuid, "2", 1, 0, ""}, now);
  now.steady += 2s;
  EXPECT_THAT(all<Publish>(confirm(sut->on_time(now))), IsEmpty());
  EXPECT_THAT(all<Publish>(confirm(request(1))), IsEmpty());
}

TEST_F(CoreCallsTest, RunsAnInheritedCallThatMayRunTwice) {
  start_with(instance(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

TEST_F(CoreCallsTest, ForgetsWhatItInheritedOnceTheProgramRequestsNothing) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  const ServiceSnapshot idle{ReadSet::state, "", "", 0, 0, ""};
  sut->on_read({"cnc", 1}, idle, now);
  now.steady += 1s;
  ASSERT_THAT(all<Read>(sut->on_time(now)), SizeIs(1));
  sut->on_read({"cnc", 1}, idle, now);
  EXPECT_THAT(all<Publish>(confirm(request(1))), SizeIs(1));
}

// Two gateways hear each other again while a read of one is under way, and that read is older than
// the request. Found by the simulation (seed 25671): the call ran twice.
TEST_F(CoreCallsTest, RemembersWhatItInheritedWhenAnOlderReadShowsNoRequest) {
  start_with(at_most_once(1));
  sut->predecessor_call({"cnc", 1}, uuid, "gateway 5f");
  sut->on_read({"cnc", 1}, {ReadSet::state, "", "", 0, 0, ""}, now);
  const auto actions = request(1);
  EXPECT_THAT(all<Publish>(confirm(actions)), IsEmpty());
  EXPECT_EQ(all<PublishStatus>(actions).back().status.state, fabric::ChannelState::held);
}

TEST_F(CoreCallsTest, AppliesNewPoliciesToRequestsThatWait) {
  start();
  link_up();
  request(1);
  now.steady += 5s;
  EXPECT_THAT(all<Read>(sut->change({.everywhere = {.unserved = Rule{1s, 901}}}, now)), SizeIs(1));
  request(1);
  sut->on_time(now);
  const auto records = all<Record>(request(1));
  ASSERT_THAT(records, testing::Not(IsEmpty()));
  EXPECT_EQ(std::get<AnsweredEntry>(records.back().entry).answer.state, 901U);
}

TEST_F(CoreCallsTest, KeepsThePolicyUnderWhichACallWasAccepted) {
  start({.everywhere = {.deadline = Rule{10s, 0}}});
  link_up();
  sut->on_instance_ready(instance(1), now);
  confirm(request(1));
  sut->change({.everywhere = {.deadline = Rule{1s, 902}}}, now);
  now.steady += 5s;
  EXPECT_THAT(all<Record>(sut->on_time(now)), IsEmpty());
}

// A regression: the deadline of one call had passed, its instance got the call of another channel,
// which then used the link that was gone: the gateway crashed. Found by the simulation.
TEST_F(CoreCallsTest, ReadsNothingOverALinkThatIsRemovedWhileACallEnds) {
  start({.everywhere = {.deadline = Rule{1s, 902}}});
  link_up();
  sut->on_instance_ready(instance(1), now);
  confirm(request(1));
  now.steady += 800ms;
  confirm(request(2));
  now.steady += 500ms;
  const auto actions = sut->on_link_dropped("cnc", "this gateway stood still", now);
  EXPECT_THAT(all<Record>(actions), SizeIs(2)) << "one is answered, one is dispatched";
  EXPECT_THAT(all<Read>(actions), IsEmpty());
}

}  // namespace
}  // namespace millrace::gateway
