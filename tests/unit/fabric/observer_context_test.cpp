#include <set>

#include <gtest/gtest.h>

#include "fabric/observer/alarms.hpp"
#include "fabric/observer/context.hpp"
#include "fabric/observer/entry.hpp"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::fabric::observer {
namespace {

using tools::recording::tests::one_call;
using tools::recording::tests::square_root;

InstanceId instance(std::uint8_t byte) {
  InstanceId id;
  id.bytes.fill(byte);
  return id;
}

Entry of(Sample sample) {
  return {.sample = std::move(sample)};
}

std::string uuid_after(Context& context, Entry entry) {
  context.complete(entry);
  return entry.uuid;
}

TEST(AContext, FillsInTheUuidInCanonicalForm) {
  Context sut;
  EXPECT_EQ(uuid_after(sut, of(Request{.uuid = "560AACBF-6335-44A9-895A-8B27F3ED5E47"})),
            square_root);
  EXPECT_EQ(uuid_after(sut, of(Event{.uuid = "560AACBF-6335-44A9-895A-8B27F3ED5E47"})),
            square_root);
  EXPECT_EQ(uuid_after(sut, of(ChannelStatus{.uuid = square_root})), square_root);
}

TEST(AContext, FindsTheServiceOfAReplyByItsCall) {
  Context sut;
  Entry request = one_call(17, 0)[1];
  request.uuid.clear();
  sut.complete(request);
  Entry reply = one_call(17, 0)[3];
  reply.uuid.clear();
  EXPECT_EQ(uuid_after(sut, reply), square_root);
}

TEST(AContext, FindsTheServiceOfALateReplyByItsInstance) {
  Context sut;
  Entry reply = one_call(17, 0)[3];
  reply.uuid.clear();
  EXPECT_EQ(uuid_after(sut, reply), "");
  InstanceNews news{.change = Change::ready, .identity = {.id = instance(0x11)}};
  news.identity.uuid = square_root;
  Entry ready = of(news);
  sut.complete(ready);
  EXPECT_EQ(uuid_after(sut, reply), square_root);
}

TEST(AContext, FindsTheServiceOfAnInstanceThatIsGone) {
  Context sut;
  InstanceNews news{.change = Change::ready, .identity = {.id = instance(0x11)}};
  news.identity.uuid = square_root;
  Entry ready = of(news);
  sut.complete(ready);
  Entry gone = of(InstanceNews{.change = Change::gone, .identity = {.id = instance(0x11)}});
  EXPECT_EQ(uuid_after(sut, gone), square_root);
  EXPECT_EQ(uuid_after(sut, of(InstanceStatus{.instance = instance(0x11)})), square_root);
  EXPECT_EQ(uuid_after(sut, of(InstanceStatus{.instance = instance(0x22)})), "");
}

TEST(AContext, ForgetsTheFirstOfManyThatAreGone) {
  Context sut;
  const auto numbered = [](std::size_t number) {
    InstanceId id;
    id.bytes[0] = static_cast<std::uint8_t>(number);
    id.bytes[1] = static_cast<std::uint8_t>(number >> 8U);
    return id;
  };
  for (std::size_t i = 0; i <= Context::most_gone; ++i) {
    InstanceNews news{.change = Change::ready, .identity = {.id = numbered(i)}};
    news.identity.uuid = square_root;
    Entry ready = of(news);
    sut.complete(ready);
    Entry gone = of(InstanceNews{.change = Change::gone, .identity = {.id = numbered(i)}});
    EXPECT_EQ(uuid_after(sut, gone), square_root);
  }
  EXPECT_EQ(uuid_after(sut, of(InstanceStatus{.instance = numbered(0)})), "");
  EXPECT_EQ(uuid_after(sut, of(InstanceStatus{.instance = numbered(1)})), square_root);
}

TEST(AContext, NamesTheWithdrawnCall) {
  Context sut;
  Entry request = one_call(17, 0)[1];
  sut.complete(request);
  const std::uint64_t epoch = std::get<Request>(request.sample).call.epoch;
  const InstanceId assigned = std::get<Request>(request.sample).assigned;
  Entry withdrawal =
      of(Withdrawal{.key = {"cnc", 1}, .call = {.epoch = epoch}, .instance = assigned});
  sut.complete(withdrawal);
  EXPECT_EQ(std::get<Withdrawal>(withdrawal.sample).call.number, 17U);
  EXPECT_EQ(withdrawal.uuid, square_root);
  Entry other = of(Withdrawal{.key = {"cnc", 2}, .call = {.epoch = epoch}});
  sut.complete(other);
  EXPECT_EQ(std::get<Withdrawal>(other.sample).call, CallId{});
  EXPECT_EQ(other.uuid, "");
}

TEST(AContext, ForgetsTheOldestCallsOnly) {
  Context sut;
  const auto ask = [&sut](std::uint64_t epoch) {
    Entry entry = of(Request{.key = {"cnc", 1}, .call = {epoch, 1}, .uuid = square_root});
    sut.complete(entry);
  };
  const auto taken_back = [&sut](std::uint64_t epoch) {
    Entry entry = of(Withdrawal{.key = {"cnc", 1}, .call = {.epoch = epoch}});
    sut.complete(entry);
    return std::get<Withdrawal>(entry.sample).call;
  };
  for (std::uint64_t epoch = 1; epoch <= Context::most_pending + 1; ++epoch) {
    ask(epoch);
  }
  EXPECT_EQ(taken_back(1), CallId{});
  EXPECT_EQ(taken_back(2), (CallId{2, 1}));
}

TEST(AContext, NamesTheWithdrawnCallOfItsGateway) {
  Context sut;
  Entry request = of(Request{.key = {"cnc", 1}, .call = {7, 1}, .uuid = square_root});
  Entry another = of(Request{.key = {"cnc", 1}, .call = {8, 5}, .uuid = "dial-gauge"});
  sut.complete(request);
  sut.complete(another);
  Entry withdrawal = of(Withdrawal{.key = {"cnc", 1}, .call = {.epoch = 7}});
  sut.complete(withdrawal);
  EXPECT_EQ(std::get<Withdrawal>(withdrawal.sample).call, (CallId{7, 1}));
  EXPECT_EQ(withdrawal.uuid, square_root);
}

TEST(AContext, RemembersRequestersAndAssignedInstances) {
  Context sut;
  const Request request{.key = {"cnc", 1},
                        .call = {7, 1},
                        .assigned = instance(1),
                        .uuid = square_root,
                        .requester = 5};
  EXPECT_TRUE(sut.has_asked(key_of(request)));
  Entry asked = of(request);
  sut.complete(asked);
  RequestKey key = key_of(request);
  EXPECT_TRUE(sut.has_asked(key));
  key.requester = 6;
  EXPECT_FALSE(sut.has_asked(key));
  key.instance = instance(2);
  EXPECT_TRUE(sut.has_asked(key));

  Reply reply{.key = {"cnc", 1}, .instance = instance(1), .call = {7, 1}};
  EXPECT_TRUE(sut.was_given(reply));
  reply.instance = instance(2);
  EXPECT_FALSE(sut.was_given(reply));
  reply.call.number = 2;
  EXPECT_TRUE(sut.was_given(reply));
}

TEST(AContext, RemembersTheFirstCommandOfAnId) {
  Context sut;
  Entry first = of(Command{.id = instance(1), .issuer = "anna"});
  Entry second = of(Command{.id = instance(1), .issuer = "bert"});
  sut.complete(first);
  sut.complete(second);
  ASSERT_NE(sut.find_command(instance(1)), nullptr);
  EXPECT_EQ(sut.find_command(instance(1))->issuer, "anna");
  EXPECT_EQ(sut.find_command(instance(2)), nullptr);
}

TEST(TheAlarms, AreReportedOnceUntilTheyChange) {
  Alarms sut;
  Alarm alarm{.key = {instance(1), "archive", ""}, .text = "disk full"};
  ASSERT_TRUE(sut.on_alarm(alarm));
  EXPECT_FALSE(sut.on_alarm(alarm));
  alarm.text = "disk gone";
  const auto again = sut.on_alarm(alarm);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->alarm.text, "disk gone");
  EXPECT_FALSE(again->over);
}

TEST(TheAlarms, EndWithTheirLastText) {
  Alarms sut;
  const Alarm alarm{.key = {instance(1), "archive", ""}, .text = "disk full", .program = "a"};
  sut.on_alarm(alarm);
  const auto over = sut.over(alarm.key);
  ASSERT_TRUE(over);
  EXPECT_TRUE(over->over);
  EXPECT_EQ(over->alarm, alarm);
  EXPECT_EQ(sut.over(alarm.key)->alarm.text, "");
  EXPECT_TRUE(sut.on_alarm(alarm));
}

TEST(TheAlarms, AreRememberedUpToABound) {
  Alarms sut;
  for (std::size_t i = 0; i <= Alarms::most; ++i) {
    EXPECT_TRUE(sut.on_alarm({.key = {instance(1), "kind", std::to_string(i)}}));
  }
  EXPECT_FALSE(sut.on_alarm({.key = {instance(1), "kind", "0"}}));
  EXPECT_TRUE(sut.on_alarm({.key = {instance(1), "kind", std::to_string(Alarms::most)}}));
}

TEST(AnEntry, IsAFailureIfItsReplySaysThatTheCallHasFailed) {
  const std::set failures{ServiceCode::failed, ServiceCode::refused};
  for (const ServiceCode code :
       {ServiceCode::ok, ServiceCode::failed, ServiceCode::repeated, ServiceCode::refused}) {
    EXPECT_EQ(is_failure(Entry{.sample = Reply{.code = code}}), failures.contains(code))
        << static_cast<int>(code);
  }
}

TEST(AnEntry, IsAFailureIfItsEventIsOne) {
  const std::set failures{EventKind::lost, EventKind::refused, EventKind::held};
  for (const EventKind kind :
       {EventKind::seen, EventKind::unserved, EventKind::dispatched, EventKind::interim,
        EventKind::replied, EventKind::written, EventKind::withdrawn, EventKind::lost,
        EventKind::late, EventKind::refused, EventKind::held}) {
    EXPECT_EQ(is_failure(Entry{.sample = Event{.kind = kind}}), failures.contains(kind))
        << static_cast<int>(kind);
  }
}

TEST(AnEntry, IsNoFailureWithoutAReplyAndAnEvent) {
  EXPECT_FALSE(is_failure(Entry{.sample = Request{}}));
  EXPECT_FALSE(is_failure(Entry{.sample = ChannelStatus{.state = ChannelState::held}}));
}

}  // namespace
}  // namespace millrace::fabric::observer
