#include "fabric/lcm/mirror.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <millrace/mirror_event_t.hpp>
#include <millrace/mirror_request_t.hpp>

#include "fabric/lcm/message.hpp"

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
