// The room that instances announce: declined calls, calls of other gateways, instances that do not
// receive.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/dispatch/dispatcher.hpp"
#include "tests/unit/gateway/decisions_in_words.hpp"

namespace millrace::gateway::capacity {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using namespace std::chrono_literals;

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
constexpr SteadyTime start{std::chrono::hours(1)};

fabric::InstanceIdentity instance(std::uint8_t number) {
  fabric::InstanceIdentity identity{.uuid = uuid, .name = fmt::format("service{}", number)};
  identity.id.bytes.fill(number);
  return identity;
}

fabric::CallId own_call(std::uint64_t number) {
  return {1, number};
}
fabric::CallId call_of_others(std::uint64_t number) {
  return {2, number};
}

class DispatcherCapacity : public testing::Test {
 protected:
  void ready(std::initializer_list<std::uint8_t> numbers) {
    for (const std::uint8_t number : numbers) {
      sut.on_instance_ready(instance(number));
    }
  }
  std::vector<std::string> add(std::uint64_t number) {
    CallRecord record;
    record.id = own_call(number);
    record.key = {"cnc", static_cast<std::uint16_t>(number)};
    record.request = {uuid, "2", 1};
    return in_words(sut.add(record));
  }
  std::vector<std::string> decline(std::uint64_t number, SteadyTime now = start) {
    return in_words(sut.decline(own_call(number), now));
  }
  std::vector<std::string> heartbeat(std::uint8_t number, const std::vector<fabric::CallId>& calls,
                                     SteadyTime now = start, std::uint32_t waiting = 0) {
    fabric::InstanceLoad load{.status = {.waiting = waiting}, .calls = calls};
    load.status.instance.bytes.fill(number);
    return in_words(sut.on_load(load, now));
  }

  dispatch::Dispatcher sut;
};

TEST_F(DispatcherCapacity, DispatchesADeclinedCallToTheNextInstanceAtOnce) {
  ready({1, 2});
  EXPECT_THAT(add(1), ElementsAre("1→1#1"));
  EXPECT_THAT(decline(1), ElementsAre("1→2#2"));
}

TEST_F(DispatcherCapacity, RetriesADecliningInstanceWhenAHeartbeatShowsRoom) {
  ready({1});
  add(1);
  EXPECT_THAT(decline(1), ElementsAre("1: the only instance is busy"));
  EXPECT_THAT(heartbeat(1, {}), ElementsAre("1→1#2"));
}

TEST_F(DispatcherCapacity, RetriesADecliningInstanceWithoutHeartbeatsAfterAWhile) {
  ready({1});
  add(1);
  decline(1);
  ASSERT_EQ(sut.next_time(), start + 1s);
  EXPECT_THAT(in_words(sut.on_time(start + 1s)), ElementsAre("1→1#2"));
}

TEST_F(DispatcherCapacity, IgnoresTheReportedRoomOfAnInstanceThatDeclinesAgainAndAgain) {
  ready({1});
  add(1);
  for (int i = 0; i < 8; ++i) {
    decline(1);
    heartbeat(1, {});
  }
  EXPECT_THAT(heartbeat(1, {}), IsEmpty());
  ASSERT_EQ(sut.next_time(), start + 5s);
  EXPECT_THAT(in_words(sut.on_time(start + 5s)), ElementsAre("1→1#9"));
}

TEST_F(DispatcherCapacity, IgnoresTheDeclineOfACallThatIsOver) {
  ready({1});
  add(1);
  sut.remove(own_call(1));
  EXPECT_THAT(decline(1), IsEmpty());
}

TEST_F(DispatcherCapacity, PrefersAnIdleInstanceToOneWithCallsOfOthers) {
  ready({1, 2});
  heartbeat(1, {call_of_others(1)});
  EXPECT_THAT(add(1), ElementsAre("1→2#1"));
}

TEST_F(DispatcherCapacity, LetsOneCallWaitWhereOthersHaveAllTheRoom) {
  ready({1});
  heartbeat(1, {call_of_others(1)});
  EXPECT_THAT(add(1), ElementsAre("1→1#1 waits"));
  EXPECT_THAT(add(2), ElementsAre("2: the only instance is busy"));
  EXPECT_THAT(heartbeat(1, {call_of_others(1), own_call(1)}, start, 1), IsEmpty())
      << "it still waits";
}

TEST_F(DispatcherCapacity, CountsItsOwnCallsInAHeartbeatOnce) {
  auto two = instance(1);
  two.concurrency = 2;
  sut.on_instance_ready(two);
  add(1);
  heartbeat(1, {own_call(1)});
  EXPECT_THAT(add(2), ElementsAre("2→1#1"));
}

TEST_F(DispatcherCapacity, WithdrawsACallThatTheHeartbeatsOfItsInstanceNeverShow) {
  ready({1, 2});
  add(1);
  sut.on_published(own_call(1), start);
  EXPECT_THAT(heartbeat(1, {}, start + 600ms), IsEmpty());
  EXPECT_THAT(heartbeat(1, {}, start + 700ms), IsEmpty()) << "the answer may be on its way";
  EXPECT_THAT(heartbeat(1, {}, start + 800ms), ElementsAre("1 lost", "1→2#2"));
  EXPECT_THAT(add(2), ElementsAre("2: the only instance is busy"))
      << "an instance that does not hear gets no call";
  ASSERT_EQ(sut.next_time(), start + 800ms + 5s);
  EXPECT_THAT(in_words(sut.on_time(*sut.next_time())), ElementsAre("2→1#1")) << "another try";
}

// A heartbeat may cross a message; only two in a row prove that the instance does not have the
// call.
TEST_F(DispatcherCapacity, LeavesACallThatHeartbeatsNameNowAndThen) {
  ready({1, 2});
  add(1);
  sut.on_published(own_call(1), start);
  for (auto at = start + 700ms; at < start + 5s; at += 200ms) {
    ASSERT_THAT(heartbeat(1, {}, at), IsEmpty());
    ASSERT_THAT(heartbeat(1, {own_call(1)}, at + 100ms), IsEmpty());
  }
}

TEST_F(DispatcherCapacity, BlocksAnAtMostOnceCallOfAnInstanceThatDoesNotReceive) {
  auto once = instance(1);
  once.delivery = fabric::Delivery::at_most_once;
  sut.on_instance_ready(once);
  add(1);
  sut.on_published(own_call(1), start);
  heartbeat(1, {}, start + 700ms);
  EXPECT_THAT(heartbeat(1, {}, start + 800ms), ElementsAre("1 held"));
}

TEST_F(DispatcherCapacity, LeavesACallWithTheInstanceThatHasIt) {
  ready({1, 2});
  add(1);
  sut.on_published(own_call(1), start);
  for (int i = 1; i < 100; ++i) {
    ASSERT_THAT(heartbeat(1, {own_call(1)}, start + i * 100ms), IsEmpty());
  }
}

TEST_F(DispatcherCapacity, ToleratesACallThatWaitsForTheJournal) {
  ready({1, 2});
  add(1);
  EXPECT_THAT(heartbeat(1, {}, start + 10s), IsEmpty());
  EXPECT_THAT(heartbeat(1, {}, start + 11s), IsEmpty());
}

TEST_F(DispatcherCapacity, FindsAnInstanceOfTwoScopesOnce) {
  auto named = instance(1);
  named.channels = {{"cnc", 1}, {"cnc", 0}};
  sut.on_instance_ready(named);
  EXPECT_THAT(add(1), ElementsAre("1→1#1"));
  EXPECT_THAT(add(2), ElementsAre("2: the only instance is busy"));
}

TEST_F(DispatcherCapacity, CountsACallThatMovedAwayAsLoadOfTheInstanceThatStillRunsIt) {
  ready({1, 2});
  add(1);
  sut.on_instance_gone(instance(1).id, start);
  ASSERT_THAT(in_words(sut.on_time(start + 1s)), ElementsAre("1 lost", "1→2#2"));
  ready({1});
  heartbeat(1, {own_call(1)}, start + 1s);
  EXPECT_THAT(add(2), ElementsAre("2→1#1 waits"));
}

TEST_F(DispatcherCapacity, AcceptsTheReportedRoomOfAnInstanceThatDeclinesAndAnswersInBetween) {
  ready({1});
  for (std::uint64_t number = 1; number <= 20; ++number) {
    ASSERT_THAT(add(number), ElementsAre(fmt::format("{}→1#1", number)));
    decline(number);
    ASSERT_THAT(heartbeat(1, {}), ElementsAre(fmt::format("{}→1#2", number)));
    sut.remove(own_call(number));
  }
}

TEST_F(DispatcherCapacity, LetsOnlyOneCallWaitHoweverManyAnInstanceRunsAtOnce) {
  auto two = instance(1);
  two.concurrency = 2;
  sut.on_instance_ready(two);
  heartbeat(1, {call_of_others(1), call_of_others(2)});
  EXPECT_THAT(add(1), ElementsAre("1→1#1 waits"));
  EXPECT_THAT(add(2), ElementsAre("2: the only instance is busy"));
}

}  // namespace
}  // namespace millrace::gateway::capacity
