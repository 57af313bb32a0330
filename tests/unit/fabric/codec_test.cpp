#include "fabric/wire/codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Time at(std::int64_t nanoseconds) {
  return Time(std::chrono::nanoseconds(nanoseconds));
}

Request request() {
  return {.key = {.machine = "cnc", .channel = 3},
          .call = {.epoch = 5, .number = 6},
          .attempt = 7,
          .assigned = InstanceId::random(),
          .uuid = "560AACBF-6335-44a9-895A-8B27F3ED5E47",
          .text = std::string("\xe4\0x", 3),
          .state = 8,
          .deadline = at(9),
          .seen = at(10),
          .dispatched = at(11),
          .replayed = true};
}

Event event() {
  return {.key = {.machine = "cnc", .channel = 3}, .uuid = "weather", .text = "4", .detail = "why"};
}

std::vector<std::string> keys_of(const wire::Topic& topic) {
  std::vector<std::string> keys;
  for (std::uint32_t i = 0; i < topic.type->m_nkeys; ++i) {
    keys.emplace_back(topic.type->m_keys[i].m_name);
  }
  return keys;
}

// What is asked by one gateway and what another asks are apart, and so is what each instance is
// asked.
TEST(Topics, HaveGatewayAndInstanceInTheKeyOfRequestsAndReplies) {
  EXPECT_THAT(keys_of(wire::request_topic), ElementsAre("machine", "channel", "assigned", "epoch"));
  EXPECT_THAT(keys_of(wire::reply_topic), ElementsAre("machine", "channel", "instance", "epoch"));
  EXPECT_THAT(keys_of(wire::channel_topic), ElementsAre("machine", "channel"));
  EXPECT_THAT(keys_of(wire::event_topic), IsEmpty());
  EXPECT_THAT(keys_of(wire::command_topic), IsEmpty());
}

TEST(Codec, CarriesARequest) {
  const Request sut = request();
  const Request copy = wire::Codec<Request>::decode(*wire::Codec<Request>::encode(sut));
  EXPECT_EQ(copy.key, sut.key);
  EXPECT_EQ(copy.call, sut.call);
  EXPECT_EQ(copy.attempt, 7U);
  EXPECT_EQ(copy.assigned, sut.assigned);
  EXPECT_EQ(copy.uuid, sut.uuid);
  EXPECT_EQ(copy.text, sut.text);
  EXPECT_EQ(copy.state, 8U);
  EXPECT_EQ(copy.deadline, at(9));
  EXPECT_EQ(copy.seen, at(10));
  EXPECT_EQ(copy.dispatched, at(11));
  EXPECT_TRUE(copy.replayed);
}

TEST(Codec, CarriesAReply) {
  const Reply sut{.key = {.machine = "cnc", .channel = 3},
                  .instance = InstanceId::random(),
                  .call = {.epoch = 5, .number = 6},
                  .attempt = 2,
                  .kind = ReplyKind::interim,
                  .code = ServiceCode::refused,
                  .text = "half",
                  .state = 50,
                  .received = at(1),
                  .started = at(2),
                  .answered = at(3),
                  .replayed = true};
  const Reply copy = wire::Codec<Reply>::decode(*wire::Codec<Reply>::encode(sut));
  EXPECT_EQ(copy.instance, sut.instance);
  EXPECT_EQ(copy.kind, ReplyKind::interim);
  EXPECT_EQ(copy.code, ServiceCode::refused);
  EXPECT_EQ(copy.text, "half");
  EXPECT_EQ(copy.state, 50U);
  EXPECT_EQ(copy.answered, at(3));
}

TEST(Codec, CarriesAStatusOfAChannel) {
  const ChannelStatus sut{.key = {.machine = "cnc", .channel = 3},
                          .state = ChannelState::held,
                          .since = at(4),
                          .uuid = "weather",
                          .reason = "nobody serves it",
                          .late = 12};
  const ChannelStatus copy =
      wire::Codec<ChannelStatus>::decode(*wire::Codec<ChannelStatus>::encode(sut));
  EXPECT_EQ(copy.state, ChannelState::held);
  EXPECT_EQ(copy.reason, "nobody serves it");
  EXPECT_EQ(copy.late, 12U);
}

TEST(Codec, CarriesABeat) {
  const InstanceLoad busy{.status = {.instance = InstanceId::random(),
                                     .running = 2,
                                     .waiting = 1,
                                     .answered = 2,
                                     .failed = 3,
                                     .repeated = 4,
                                     .cancelled = 5,
                                     .declined = 6,
                                     .mean = std::chrono::nanoseconds(6),
                                     .started = at(7),
                                     .last_call = at(8)},
                          .calls = {{7, 1}, {7, 2}, {8, 1}}};
  const InstanceLoad idle{.status = {.instance = InstanceId::random()}};
  const Beat sut{.member = InstanceId::random(), .at = at(9), .loads = {busy, idle}};
  EXPECT_EQ(wire::Codec<Beat>::decode(*wire::Codec<Beat>::encode(sut)), sut);
}

TEST(Codec, RefusesABeatWithMoreLoadsOrCallsThanFit) {
  EXPECT_EQ(wire::Codec<Beat>::encode({.loads = std::vector<InstanceLoad>(65)}).error(),
            "the loads of 65 instances are named, at most 64 fit");
  const InstanceLoad busy{.calls = std::vector<CallId>(257)};
  EXPECT_EQ(wire::Codec<Beat>::encode({.loads = {busy}}).error(),
            "an instance has 257 calls, at most 256 can be named");
}

TEST(Codec, CarriesAnEvent) {
  Event sut = event();
  sut.kind = EventKind::late;
  const Event copy = wire::Codec<Event>::decode(*wire::Codec<Event>::encode(sut));
  EXPECT_EQ(copy.kind, EventKind::late);
  EXPECT_EQ(copy.text, "4");
  EXPECT_EQ(copy.detail, "why");
}

TEST(Codec, AcceptsWhatJustFits) {
  Request sut = request();
  sut.text.assign(127, 'x');
  sut.uuid.assign(127, 'x');
  sut.key.machine.assign(63, 'x');
  ASSERT_TRUE(wire::Codec<Request>::encode(sut));
  EXPECT_EQ(wire::Codec<Request>::decode(*wire::Codec<Request>::encode(sut)).uuid, sut.uuid);
}

TEST(Codec, RefusesWhatWouldBeCut) {
  const auto error = [](auto change) {
    Event sut = event();
    change(sut);
    const auto sample = wire::Codec<Event>::encode(sut);
    return sample ? "" : sample.error();
  };
  EXPECT_EQ(error([](Event& sut) { sut.text.assign(128, 'x'); }),
            "the text has 128 bytes, at most 127 fit");
  EXPECT_EQ(error([](Event& sut) { sut.uuid.assign(128, 'x'); }),
            "the UUID has 128 bytes, at most 127 fit");
  EXPECT_EQ(error([](Event& sut) { sut.detail.assign(256, 'x'); }),
            "the detail has 256 bytes, at most 255 fit");
  EXPECT_EQ(error([](Event& sut) { sut.key.machine.assign(64, 'x'); }),
            "the machine name has 64 bytes, at most 63 fit");
  EXPECT_EQ(error([](Event& sut) { sut.key.machine.clear(); }), "the machine has no name");
  EXPECT_EQ(error([](Event& sut) { sut.uuid = std::string("a\0b", 3); }),
            "the UUID contains a NUL byte");
}

TEST(MachineStatusCodec, KeepsEveryField) {
  const MachineStatus sut{.machine = "cnc",
                          .gateway = {{1, 2, 3}},
                          .claimed = Time(std::chrono::seconds(4)),
                          .claims = {1, 3},
                          .connected = true,
                          .since = Time(std::chrono::seconds(5)),
                          .address = "192.168.0.5:48898, 5.1.2.3.1.1",
                          .reason = "none",
                          .channels = 4,
                          .poll = std::chrono::milliseconds(10),
                          .requests_per_second = 400,
                          .round_trip = std::chrono::microseconds(250),
                          .host = "gateway-host",
                          .pid = 4711,
                          .version = "0.1.0",
                          .epoch = 0x5f3a9c0112d4};
  const MachineStatus copy =
      wire::Codec<MachineStatus>::decode(*wire::Codec<MachineStatus>::encode(sut));
  EXPECT_EQ(copy, sut);
}

TEST(MachineStatusCodec, RefusesAReasonThatDoesNotFit) {
  EXPECT_FALSE(wire::Codec<MachineStatus>::encode({.reason = std::string(256, 'x')}));
}

}  // namespace
}  // namespace millrace::fabric
