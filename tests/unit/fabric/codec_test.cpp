#include "fabric/wire/codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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

// Requests of two gateways have different keys, and so have requests to two instances.
TEST(Topics, HaveGatewayAndInstanceInTheKeyOfRequestsAndReplies) {
  EXPECT_THAT(keys_of(wire::request_topic), ElementsAre("machine", "channel", "assigned", "epoch"));
  EXPECT_THAT(keys_of(wire::reply_topic), ElementsAre("machine", "channel", "instance", "epoch"));
  EXPECT_THAT(keys_of(wire::channel_topic), ElementsAre("machine", "channel"));
  EXPECT_THAT(keys_of(wire::event_topic), IsEmpty());
  EXPECT_THAT(keys_of(wire::command_topic), IsEmpty());
}

TEST(Codec, RefusesAHeartbeatWithMoreLoadsOrCallsThanFit) {
  EXPECT_EQ(wire::Codec<Heartbeat>::encode({.loads = std::vector<InstanceLoad>(65)}).error(),
            "65 loads, at most 64 fit");
  const InstanceLoad busy{.calls = std::vector<CallId>(257)};
  EXPECT_EQ(wire::Codec<Heartbeat>::encode({.loads = {busy}}).error(),
            "loads[0]: 257 calls, at most 256 fit");
}

TEST(Codec, AcceptsWhatJustFits) {
  const Request sut{.key = {.machine = std::string(63, 'x')},
                    .uuid = std::string(127, 'x'),
                    .text = std::string(127, '\0')};
  ASSERT_TRUE(wire::Codec<Request>::encode(sut));
  EXPECT_EQ(wire::Codec<Request>::decode(*wire::Codec<Request>::encode(sut)), sut);
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

TEST(MachineStatusCodec, RefusesAReasonThatDoesNotFit) {
  EXPECT_FALSE(wire::Codec<MachineStatus>::encode({.reason = std::string(256, 'x')}));
}

}  // namespace
}  // namespace millrace::fabric
