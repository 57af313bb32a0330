#include "fabric/wire/codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/messages/catalogue.hpp"
#include "fabric/messages.hpp"
#include "fabric/words.hpp"

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

TEST(Codec, ShortensASentenceInsteadOfLosingItsSample) {
  Event sut = event();
  sut.detail = base::messages::declined(std::string(300, 'x'), std::string("a\0b", 3));
  const Event sent = wire::Codec<Event>::decode(*wire::Codec<Event>::encode(sut));
  EXPECT_EQ(sent.detail.code, "declined");
  EXPECT_EQ(sent.detail.text, std::string(251, 'x') + " …");
  EXPECT_THAT(sent.detail.arguments, ElementsAre(std::string(251, 'x') + " …", "ab"));
}

TEST(Codec, KeepsACodeThatThisVersionDoesNotKnow) {
  Event sut = event();
  sut.kind = static_cast<EventKind>(77);
  const Event sent = wire::Codec<Event>::decode(*wire::Codec<Event>::encode(sut));
  EXPECT_EQ(sent.kind, sut.kind);
  EXPECT_EQ(name_of(sent.kind), "unknown (77)");
}

TEST(Codec, KeepsTheElementsOfATypeThatThisVersionDoesNotKnow) {
  DataSample sut{.key = {"press", 1}, .group = "axes"};
  for (const Elements& elements :
       {Elements(std::vector<std::int64_t>{7}), Elements(std::vector<double>{1.5}),
        Elements(std::vector<std::string>{"T7"})}) {
    sut.values.push_back({.name = "V.A.LATER", .type = static_cast<ValueType>(200)});
    sut.values.back().elements = elements;
  }
  EXPECT_EQ(wire::Codec<DataSample>::decode(*wire::Codec<DataSample>::encode(sut)), sut);
}

TEST(Codec, KeepsTheExtrasOfALaterVersionWithinLimits) {
  Event sut = event();
  sut.extras = {
      {"tool", "T7"}, {"picture", std::string(1025, 'x')}, {"order", std::string(1024, 'x')}};
  EXPECT_THAT(wire::Codec<Event>::decode(*wire::Codec<Event>::encode(sut)).extras,
              ElementsAre(sut.extras[0], sut.extras[2]));
  sut.extras = Extras(17, {"tool", "T7"});
  EXPECT_EQ(wire::Codec<Event>::decode(*wire::Codec<Event>::encode(sut)).extras.size(), 16U);
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
  EXPECT_EQ(error([](Event& sut) { sut.key.machine.assign(64, 'x'); }),
            "the machine name has 64 bytes, at most 63 fit");
  EXPECT_EQ(error([](Event& sut) { sut.key.machine.clear(); }), "the machine has no name");
  EXPECT_EQ(error([](Event& sut) { sut.uuid = std::string("a\0b", 3); }),
            "the UUID contains a NUL byte");
}

const std::string canonical = "560aacbf-6335-44a9-895a-8b27f3ed5e47";

TEST(CanonicalUuid, IsLowerCaseWithoutBracesAndBlanks) {
  EXPECT_EQ(canonical_uuid("560AACBF-6335-44a9-895A-8B27F3ED5E47"), canonical);
  EXPECT_EQ(canonical_uuid(" {560AACBF-6335-44A9-895A-8B27F3ED5E47}\r\n"), canonical);
}

TEST(CanonicalUuid, LeavesAnIdentifierThatIsNoUuidAsItIs) {
  // In the NC sample of the vendor's manual, one character of the service's UUID is missing.
  EXPECT_EQ(canonical_uuid("560AACBF-6335-44a9-895A-8B27F3ED5E4"),
            "560AACBF-6335-44a9-895A-8B27F3ED5E4");
  EXPECT_EQ(canonical_uuid("  Weather "), "Weather");
  EXPECT_EQ(canonical_uuid("{Weather}"), "{Weather}");
  EXPECT_EQ(canonical_uuid("  "), "");
}

TEST(InstanceId, ReadsWhatItWrites) {
  const InstanceId sut = InstanceId::random();
  EXPECT_TRUE(is_uuid(sut.to_string()));
  EXPECT_EQ(InstanceId::parse(sut.to_string()), sut);
  EXPECT_EQ(InstanceId::parse(canonical)->to_string(), canonical);
  EXPECT_EQ(InstanceId::parse("560AACBF-6335-44A9-895A-8B27F3ED5E47")->to_string(), canonical);
  EXPECT_FALSE(InstanceId::parse("560aacbf"));
}

TEST(InstanceId, IsAnotherOneEachTimeAndOfVersion4) {
  const InstanceId sut = InstanceId::random();
  EXPECT_NE(sut, InstanceId::random());
  EXPECT_EQ(sut.to_string()[14], '4');
  EXPECT_NE(std::string("89ab").find(sut.to_string()[19]), std::string::npos);
}

TEST(Messages, PrintTheirKeys) {
  EXPECT_EQ((ChannelKey{"cnc", 3}.to_string()), "cnc/3");
  EXPECT_EQ((CallId{0x5f3a9c0112d4, 17}.to_string()), "5f3a9c0112d4-17");
}

TEST(Words, NameEveryEnumerator) {
  EXPECT_EQ(name_of(ReplyKind::final), "final");
  EXPECT_EQ(name_of(ServiceCode::refused), "refused");
  EXPECT_EQ(name_of(ChannelState::link_down), "link down");
  EXPECT_EQ(name_of(ChannelState::held), "held");
  EXPECT_EQ(name_of(EventKind::seen), "seen");
  EXPECT_EQ(name_of(EventKind::held), "held");
  EXPECT_EQ(name_of(CommandKind::ping), "ping");
}

TEST(Words, NameAnUnknownValueAsUnknown) {
  EXPECT_EQ(name_of(static_cast<EventKind>(11)), "unknown (11)");
  EXPECT_EQ(name_of(static_cast<Delivery>(2)), "unknown (2)");
}

TEST(Words, OfDeliveryAreReadAsTheyAreWritten) {
  for (const Delivery delivery : {Delivery::at_least_once, Delivery::at_most_once}) {
    EXPECT_EQ(parse_delivery(name_of(delivery)), delivery);
  }
  for (const CompletionSignal completion_signal :
       {CompletionSignal::response_state, CompletionSignal::response}) {
    EXPECT_EQ(parse_completion_signal(name_of(completion_signal)), completion_signal);
  }
  EXPECT_EQ(parse_delivery("at most once"), std::nullopt);
  EXPECT_EQ(parse_delivery(""), std::nullopt);
}

}  // namespace
}  // namespace millrace::fabric
