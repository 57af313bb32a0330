#include "tools/caller/caller.hpp"

#include <atomic>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/format.hpp"
#include "base/program/log.hpp"
#include "fabric/plant/plant.hpp"
#include "services/sdk/service.hpp"
#include "tests/support/await.hpp"
#include "tests/support/domain.hpp"
#include "tests/support/wait_for.hpp"
#include "tools/caller/calls.hpp"

namespace millrace::tools::caller {
namespace {

using namespace std::chrono_literals;
using services::sdk::Call;
using services::sdk::Handler;
using services::sdk::Response;
using services::sdk::Service;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using tests::run_until;

const std::string wanted_uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

Moment at(std::chrono::milliseconds offset) {
  return {SteadyTime(std::chrono::hours(1) + offset), fabric::Time(std::chrono::hours(2) + offset)};
}

fabric::InstanceIdentity instance(std::uint8_t number,
                                  std::vector<fabric::ChannelScope> channels = {}) {
  fabric::InstanceIdentity identity;
  identity.id.bytes.fill(number);
  identity.uuid = wanted_uuid;
  identity.channels = std::move(channels);
  return identity;
}

Order order(std::uint16_t channel) {
  return {.key = {"call.1", channel}, .uuid = wanted_uuid, .text = "2", .patience = 5s};
}

/// "1→7#2": channel 1's call goes to instance 7 as attempt 2; "-1": it is withdrawn; "1=text" and
/// "1: reason": its end.
std::vector<std::string> words(const Actions& actions) {
  std::vector<std::string> out;
  for (const Action& action : actions) {
    if (const auto* publish = std::get_if<Publish>(&action)) {
      out.push_back(fmt::format("{}→{}#{}", publish->request.key.channel,
                                publish->request.assigned.bytes[0], publish->request.attempt));
    } else if (const auto* withdraw = std::get_if<Withdraw>(&action)) {
      out.push_back(fmt::format("-{}", withdraw->key.key.channel));
    } else if (const auto* ended = std::get_if<Ended>(&action)) {
      out.push_back(ended->reply ? fmt::format("{}={}", ended->key.channel, ended->reply->text)
                                 : fmt::format("{}: {}", ended->key.channel, ended->reason));
    } else if (const auto* interim = std::get_if<Interim>(&action)) {
      out.push_back(fmt::format("{}~{}", interim->reply.key.channel, interim->reply.text));
    }
  }
  return out;
}

fabric::Request published(const Actions& actions) {
  for (const Action& action : actions) {
    if (const auto* publish = std::get_if<Publish>(&action)) {
      return publish->request;
    }
  }
  throw std::runtime_error("nothing was published");
}

TEST(Calls, DispatchesACallToAnInstanceAndEndsItWithItsReply) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  const auto id = sut.add(order(1), at(1ms));
  ASSERT_TRUE(id.has_value());
  const fabric::Request request = published(sut.take_actions());
  EXPECT_EQ(request.call, *id);
  EXPECT_EQ(request.text, "2");
  EXPECT_EQ(request.assigned, instance(3).id);
  EXPECT_EQ(request.deadline, at(5001ms).wall);
  sut.on_reply(reply_to(request, "1.414214", 1), at(2ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("1=1.414214"));
  EXPECT_EQ(sut.pending(), 0U);
}

TEST(Calls, ReplacesAnAnsweredRequestOrWithdrawsItAfterASecond) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  for (const auto time : {1ms, 900ms, 1800ms}) {
    ASSERT_TRUE(sut.add(order(1), at(time)).has_value());
    sut.on_reply(reply_to(published(sut.take_actions()), "2", 1), at(time));
    EXPECT_THAT(words(sut.take_actions()), ElementsAre("1=2"));
    sut.on_time(at(time));
    EXPECT_THAT(words(sut.take_actions()), IsEmpty());
  }
  EXPECT_EQ(sut.next_time(), at(2800ms).steady);
  sut.on_time(at(2800ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("-1"));
}

TEST(Calls, WithdrawsAllRequestsWhenItLeaves) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  sut.on_reply(reply_to(published(sut.take_actions()), "2", 1), at(1ms));
  ASSERT_TRUE(sut.add(order(2), at(2ms)).has_value());
  sut.take_actions();
  sut.leave("bye", at(3ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("-2", "2: bye", "-1"));
}

TEST(Calls, WaitsForAnInstanceThatComesLater) {
  Calls sut({7, 0});
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  EXPECT_THAT(words(sut.take_actions()), IsEmpty());
  sut.on_instance_ready(instance(3), at(100ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("1→3#1"));
}

TEST(Calls, CountsTheTimeSinceTheDispatchAndNotTheSearchForAnInstance) {
  Calls sut({7, 0});
  const auto id = sut.add(order(1), at(0ms));
  ASSERT_TRUE(id.has_value());
  EXPECT_FALSE(sut.is_given_out(*id));
  sut.on_instance_ready(instance(3), at(400ms));
  EXPECT_TRUE(sut.is_given_out(*id));
  const fabric::Request request = published(sut.take_actions());
  sut.on_reply(reply_to(request, "1.4", 1), at(402ms));
  for (const Action& action : sut.take_actions()) {
    if (const auto* ended = std::get_if<Ended>(&action)) {
      EXPECT_EQ(ended->took, 2ms);
    }
  }
  EXPECT_FALSE(sut.is_given_out(*id));
}

TEST(Calls, StayDispatchedWhileTheirInstanceDrains) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  const auto id = sut.add(order(1), at(1ms));
  auto leaving = instance(3);
  leaving.draining = true;
  sut.on_instance_ready(leaving, at(2ms));
  EXPECT_TRUE(sut.why_unserved(wanted_uuid, order(1).key).has_value());
  EXPECT_TRUE(sut.is_given_out(*id));
}

TEST(Calls, ChoosesTheInstanceByTheScopeOfAnotherChannel) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  sut.on_instance_ready(instance(4, {{"cnc", 2}}), at(0ms));
  Order replayed = order(1);
  replayed.as = fabric::ChannelKey{"cnc", 2};
  ASSERT_TRUE(sut.add(replayed, at(1ms)).has_value());
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("1→4#1"));
}

TEST(Calls, ReportsWhatItWaitedForAfterItsTimeout) {
  Calls sut({7, 0});
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  EXPECT_EQ(sut.next_time(), at(5s).steady);
  sut.on_time(at(4999ms));
  EXPECT_THAT(words(sut.take_actions()), IsEmpty());
  sut.on_time(at(5s));
  EXPECT_THAT(
      words(sut.take_actions()),
      ElementsAre(HasSubstr("1: no response within 5 s: no service has the UUID " + wanted_uuid)));
}

TEST(Calls, WithdrawsACallFromAnInstanceThatDoesNotAnswerInTime) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  const fabric::Request request = published(sut.take_actions());
  sut.on_time(at(5s));
  EXPECT_THAT(words(sut.take_actions()),
              ElementsAre("-1", HasSubstr("the instance that has the call has not responded")));
  sut.on_reply(reply_to(request, "late", 1), at(6s));
  EXPECT_THAT(words(sut.take_actions()), IsEmpty());
}

TEST(Calls, DispatchesTheCallOfALostInstanceToAnotherOne) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  const fabric::Request first = published(sut.take_actions());
  sut.on_instance_ready(instance(4), at(1ms));
  sut.on_instance_gone(instance(3).id, at(10ms));
  ASSERT_TRUE(sut.next_time().has_value());
  sut.on_time(at(1s));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("-1", "1→4#2"));
  // The first instance was slow, not dead: its answer counts.
  sut.on_reply(reply_to(first, "1.4", 1), at(1001ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("-1", "1=1.4"));
}

TEST(Calls, DoesNotRepeatACallThatMayRunAtMostOnce) {
  Calls sut({7, 0});
  auto once = instance(3);
  once.delivery = fabric::Delivery::at_most_once;
  sut.on_instance_ready(once, at(0ms));
  sut.on_instance_ready(instance(4, {{"other", 0}}), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  sut.take_actions();
  sut.on_instance_gone(once.id, at(10ms));
  sut.on_time(at(1s));
  EXPECT_THAT(words(sut.take_actions()),
              ElementsAre("-1", "1: its instance is lost, and the call must not run twice"));
}

TEST(Calls, AcceptsOneCallAtATimeInAChannel) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  const auto first = sut.add(order(1), at(0ms));
  const auto second = sut.add(order(1), at(1ms));
  ASSERT_FALSE(second.has_value());
  EXPECT_THAT(second.error(),
              HasSubstr(first->to_string() + " is still pending in channel call.1/1"));
  sut.give_up(*first, "enough", at(2ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("1→3#1", "-1", "1: enough"));
  EXPECT_TRUE(sut.add(order(1), at(3ms)).has_value());
}

TEST(Calls, ShowsInterimRepliesAndContinues) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  fabric::Reply interim = reply_to(published(sut.take_actions()), "half", 1);
  interim.kind = fabric::ReplyKind::interim;
  sut.on_reply(interim, at(1ms));
  EXPECT_THAT(words(sut.take_actions()), ElementsAre("1~half"));
  EXPECT_EQ(sut.pending(), 1U);
}

TEST(Calls, IgnoresRepliesOfOtherInstances) {
  Calls sut({7, 0});
  sut.on_instance_ready(instance(3), at(0ms));
  ASSERT_TRUE(sut.add(order(1), at(0ms)).has_value());
  fabric::Reply reply = reply_to(published(sut.take_actions()), "2", 1);
  reply.instance = instance(9).id;
  sut.on_reply(reply, at(1ms));
  EXPECT_THAT(words(sut.take_actions()), IsEmpty());
}

TEST(Calls, RefusesWhatIsNoCall) {
  Calls sut({7, 0});
  Order stateless = order(1);
  stateless.state = 0;
  EXPECT_THAT(sut.add(stateless, at(0ms)).error(), HasSubstr("state 0"));
  Order endless = order(1);
  endless.text.assign(128, 'x');
  EXPECT_THAT(sut.add(endless, at(0ms)).error(), HasSubstr("128 bytes, at most 127 fit"));
  EXPECT_THAT(sut.take_actions(), IsEmpty());
}

const std::string uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

struct Listener : CallerListener {
  void on_ended(const Ended& end) override { ended.push_back(end); }
  std::vector<Ended> ended;
};

class CallerTest : public testing::Test {
 protected:
  Order order(const std::string& text) {
    return {.key = key, .uuid = uuid, .text = text, .patience = 20s, .replayed = true};
  }

  tests::Domain domain;
  boost::asio::io_context io;
  Listener listener;
  fabric::dds::Participant participant{{.domain = domain.number()}};
  const base::program::Log log = base::program::no_log();
  const Slot slot{"call", participant.options()};
  const fabric::ChannelKey key{slot.machine(), 1};
};

TEST_F(CallerTest, CallsAServiceThatStartsLater) {
  Caller sut(participant, io.get_executor(), listener, slot);
  const auto call = sut.call(order("2"));
  ASSERT_TRUE(call.has_value());
  std::atomic<bool> marked = false;
  Service service({.uuid = uuid, .name = "echo", .domain = domain.number()},
                  Handler([&](const Call& given) {
                    marked = given.replayed();
                    return Response{.text = "answer to " + given.text()};
                  }),
                  log);
  ASSERT_TRUE(run_until(io, [&] { return !listener.ended.empty(); }));
  EXPECT_EQ(listener.ended[0].call, *call);
  ASSERT_TRUE(listener.ended[0].reply.has_value()) << listener.ended[0].reason.text;
  EXPECT_EQ(listener.ended[0].reply->text, "answer to 2");
  EXPECT_TRUE(listener.ended[0].reply->replayed);
  EXPECT_TRUE(marked);
  // The channel is free for the next call.
  ASSERT_TRUE(sut.call(order("3")).has_value());
  ASSERT_TRUE(run_until(io, [&] { return listener.ended.size() == 2; }));
  EXPECT_EQ(listener.ended[1].reply->text, "answer to 3");
}

TEST_F(CallerTest, CancelsARunningHandlerWhenItIsGone) {
  std::atomic<bool> started = false;
  std::atomic<bool> cancelled = false;
  Service service({.uuid = uuid, .name = "slow", .domain = domain.number()},
                  Handler([&](const Call& given) {
                    started = true;
                    tests::await("the cancellation", [&] { return given.cancelled(); });
                    cancelled = true;
                    return Response{.text = "too late"};
                  }),
                  log);
  {
    Caller sut(participant, io.get_executor(), listener, slot);
    ASSERT_TRUE(sut.call(order("2")).has_value());
    ASSERT_TRUE(run_until(io, [&] { return started.load(); }));
  }
  EXPECT_TRUE(run_until(io, [&] { return cancelled.load(); }));
  EXPECT_TRUE(listener.ended.empty());
}

TEST_F(CallerTest, EndsACallAfterItsTimeout) {
  Caller sut(participant, io.get_executor(), listener, slot);
  Order hasty = order("2");
  hasty.patience = 50ms;
  ASSERT_TRUE(sut.call(hasty).has_value());
  ASSERT_TRUE(run_until(io, [&] { return !listener.ended.empty(); }));
  EXPECT_FALSE(listener.ended[0].reply.has_value());
  EXPECT_THAT(listener.ended[0].reason, HasSubstr("no response within 0.05 s"));
}

TEST(CallerChannel, IsRefusedWhileAGatewayServesItsMachine) {
  fabric::plant::Plant live;
  live.add({.sample = fabric::ChannelStatus{.key = {"cnc", 1}}});
  EXPECT_THAT(reason_taken(live, {"cnc", 7}).value_or(""),
              HasSubstr("a gateway serves machine 'cnc'"));
  EXPECT_EQ(reason_taken(live, {"call.1", 1}), std::nullopt);
}

class CallerSlot : public testing::Test {
 protected:
  tests::Domain domain;
  const fabric::dds::ParticipantOptions options{.domain = domain.number()};
};

TEST_F(CallerSlot, BelongsToOneCallerAtATime) {
  // More than there are slots.
  std::vector<Slot> suts;
  std::set<std::uint64_t> epochs;
  std::set<std::string> machines;
  for (int count = 0; count < Slot::most + 10; ++count) {
    const Slot& sut = suts.emplace_back("call", options);
    epochs.insert(sut.before_first().epoch);
    machines.insert(sut.machine());
  }
  EXPECT_EQ(epochs.size(), suts.size());
  EXPECT_EQ(machines.size(), suts.size());
}

TEST_F(CallerSlot, IsContinuedByTheNextCaller) {
  std::optional<Slot> first(std::in_place, "call", options);
  const std::string machine = first->machine();
  EXPECT_THAT(machine, testing::MatchesRegex("call\\.[0-9a-f]{8}"));
  const fabric::CallId id = first->before_first();
  first.reset();
  const Slot sut("replay", options);
  EXPECT_EQ(sut.machine().substr(sut.machine().find('.')), machine.substr(machine.find('.')));
  EXPECT_EQ(sut.before_first().epoch, id.epoch);
  EXPECT_GT(sut.before_first().number, id.number);
}

TEST_F(CallerSlot, IsOneOfItsFabric) {
  fabric::dds::ParticipantOptions other = options;
  other.fabric = "other";
  const std::uint64_t epoch = Slot("call", options).before_first().epoch;
  EXPECT_NE(Slot("call", other).before_first().epoch, epoch);
  EXPECT_EQ(Slot("call", options).before_first().epoch, epoch);
}

}  // namespace
}  // namespace millrace::tools::caller
