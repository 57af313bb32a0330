// Replies to a gateway that were not written by this implementation: another DDS has no such
// limits, and a stranger may give a false identity.
#include <array>

#include <dds/dds.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fabric/endpoints/call_endpoint.hpp"
#include "fabric/endpoints/reply_endpoint.hpp"
#include "fabric/messages.hpp"
#include "fabric/registry/identity.hpp"
#include "fabric/reply_keys.hpp"
#include "fabric/wire/reader.hpp"
#include "fabric/wire/writer.hpp"
#include "idl/millrace.h"
#include "tests/support/unchecked_reply_writer.hpp"
#include "tests/support/wait_for.hpp"
#include "tests/unit/fabric/recording_listeners.hpp"
#include "tests/unit/fabric/two_processes.hpp"

namespace millrace::fabric {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::SizeIs;
using tests::run_until;

const std::string watched_uuid = "560aacbf-6335-44a9-895a-8b27f3ed5e47";
const std::string partition = wire::service_partition("millrace", watched_uuid);

InstanceIdentity honest() {
  return {.id = InstanceId::random(), .uuid = watched_uuid, .name = "square_root"};
}

Reply reply(const InstanceId& instance, std::uint64_t number) {
  return {.key = {.machine = "cnc", .channel = static_cast<std::uint16_t>(number)},
          .instance = instance,
          .call = {.epoch = 7, .number = number},
          .text = "2.000000",
          .state = 1};
}

/// A writer of replies without the limits of millrace.
class RawWriter {
 public:
  RawWriter(const dds::Participant& participant, const std::string& user_data)
      : topic_(wire::create_topic(participant, wire::reply_topic)),
        publisher_(wire::create_publisher(participant, partition)),
        writer_(dds_create_writer(publisher_.handle(), topic_.handle(),
                                  wire::writer_qos(wire::reply_topic, user_data).get(), nullptr)) {
    EXPECT_GT(writer_, 0);
  }

  void write(Reply reply) {
    const std::string text = std::exchange(reply.text, "");
    auto sample = *wire::Codec<Reply>::encode(reply);
    // Cyclone only reads it.
    sample.text._buffer = reinterpret_cast<std::uint8_t*>(const_cast<char*>(text.data()));
    sample.text._length = static_cast<std::uint32_t>(text.size());
    sample.text._maximum = sample.text._length;
    EXPECT_EQ(dds_write(writer_, &sample), DDS_RETCODE_OK);
  }

 private:
  dds::Entity topic_;
  dds::Entity publisher_;
  dds_entity_t writer_;
};

class AForeignReply : public testing::Test {
 protected:
  bool until(const std::function<bool()>& done) { return run_until(context, done); }
  bool until_replies(std::size_t count) {
    return until([&] { return gateway.replies.size() == count; });
  }

  TwoProcesses processes;
  boost::asio::io_context context;
  dds::Participant here{processes.here()};
  dds::Participant there{processes.there()};
  RecordingGateway gateway;
  endpoints::CallEndpoint sut{here, context.get_executor(), gateway};
};

// A regression: it was dropped on its way, and its call waited without any log line.
TEST_F(AForeignReply, ThatIsTooLongArrivesAsItIs) {
  const InstanceId instance = InstanceId::random();
  RawWriter service(there, registry::format_instance(instance));
  Reply sent = reply(instance, 1);
  sent.text.assign(200, 'x');
  service.write(sent);
  sent.call.number = 2;
  sent.key.channel = 2;
  sent.text.assign(100'000, 'y');
  service.write(sent);
  ASSERT_TRUE(until_replies(2));
  EXPECT_EQ(gateway.replies[0].text, std::string(200, 'x'));
  EXPECT_EQ(gateway.replies[1].text, sent.text);
}

TEST_F(AForeignReply, WithANulArrivesWithIt) {
  const InstanceId instance = InstanceId::random();
  RawWriter service(there, registry::format_instance(instance));
  Reply sent = reply(instance, 1);
  sent.text = std::string("1\0 4", 4);
  service.write(sent);
  ASSERT_TRUE(until_replies(1));
  EXPECT_EQ(gateway.replies.front().text, sent.text);
}

TEST_F(AForeignReply, OfAnUnknownKindArrivesWithItsNumber) {
  const InstanceId instance = InstanceId::random();
  tests::UncheckedReplyWriter service(there, partition, registry::format_instance(instance));
  std::uint64_t number = 0;
  const std::array<std::uint8_t, 4> kinds{3, 77, 255, millrace_reply_kind_final};
  for (const std::uint8_t kind : kinds) {
    service.write(reply(instance, ++number), kind);
  }
  ASSERT_TRUE(until_replies(number));
  for (const Reply& reply : gateway.replies) {
    EXPECT_EQ(static_cast<std::uint8_t>(reply.kind), kinds.at(reply.call.number - 1));
    EXPECT_EQ(is_known(reply), reply.kind == ReplyKind::final);
  }
}

TEST_F(AForeignReply, OfAnUnknownCodeIsNotAcceptedAsAValidOne) {
  const InstanceId instance = InstanceId::random();
  tests::UncheckedReplyWriter service(there, partition, registry::format_instance(instance));
  std::uint64_t number = 0;
  for (const std::uint8_t code : std::array<std::uint8_t, 3>{4, 77, 255}) {
    service.write(reply(instance, ++number), millrace_reply_kind_final, code);
  }
  ASSERT_TRUE(until_replies(number));
  for (const Reply& reply : gateway.replies) {
    EXPECT_FALSE(is_known(reply)) << reply.call.number;
  }
}

// The key of a reply has its instance's id, which any participant can write.
TEST_F(AForeignReply, InTheNameOfAnotherInstanceDoesNotReplaceItsReply) {
  const InstanceId instance = InstanceId::random();
  // Within one domain object a write returns when its sample has arrived: both have arrived before
  // the first is taken.
  RawWriter service(here, registry::format_instance(instance));
  RawWriter stranger(here, registry::format_instance(InstanceId::random()));
  service.write(reply(instance, 1));
  Reply forged = reply(instance, 1);
  forged.text = "forged";
  stranger.write(forged);
  ASSERT_TRUE(until([&] { return !gateway.replies.empty() && !gateway.ignored.empty(); }));
  EXPECT_THAT(gateway.replies, SizeIs(1));
  EXPECT_EQ(gateway.replies.front().text, "2.000000");
}

TEST_F(AForeignReply, InTheNameOfAnotherInstanceIsDroppedAndReportedOnce) {
  const InstanceId instance = InstanceId::random();
  const InstanceId other = InstanceId::random();
  RawWriter service(there, registry::format_instance(instance));
  RawWriter writer(there, "");
  service.write(reply(other, 1));
  service.write(reply(other, 2));
  writer.write(reply(instance, 3));
  service.write(reply(instance, 4));
  ASSERT_TRUE(until([&] { return gateway.replies.size() == 1 && gateway.ignored.size() == 2; }));
  EXPECT_EQ(gateway.replies.front().call.number, 4U);
  EXPECT_THAT(gateway.ignored, testing::Each(HasSubstr("another writer sent it")));
}

TEST_F(AForeignReply, OfAProcessThatPretendsToBeTheInstanceIsDropped) {
  RecordingInstance listener;
  const endpoints::ReplyEndpoint service(here, context.get_executor(), honest(), listener);
  const InstanceId instance = service.identity().id;
  ASSERT_TRUE(until([&] { return gateway.ready.contains(instance); }));
  RawWriter stranger(there, registry::format_instance(instance));
  stranger.write(reply(instance, 1));
  ASSERT_TRUE(until([&] { return !gateway.ignored.empty(); }));
  EXPECT_THAT(gateway.replies, SizeIs(0));
}

TEST_F(AForeignReply, ThatIsOnlyDisposedIsUnexpected) {
  wire::Writer<Reply> stranger(there, partition);
  ASSERT_TRUE(until([&] { return !stranger.matched().empty(); }));
  Reply foreign = reply(InstanceId::random(), 1);
  for (foreign.call.epoch = 1; foreign.call.epoch <= ReplyKeys::most_others + 64;
       ++foreign.call.epoch) {
    stranger.withdraw(foreign);
  }
  ASSERT_TRUE(until([&] {
    // A gateway logs this when a participant joins or leaves, or sends heartbeats.
    const wire::Writer<Reply> newcomer(there, partition);
    return !gateway.ignored.empty();
  }));
  EXPECT_THAT(gateway.ignored, ElementsAre(HasSubstr("unexpected replies from more than")));
}

TEST_F(AForeignReply, OrOneOfAnInstanceThatHasLeftIsAccepted) {
  const InstanceIdentity who = honest();
  RecordingGateway late_gateway;
  // Takes nothing while the instance answers and leaves.
  boost::asio::io_context asleep;
  const endpoints::CallEndpoint late(here, asleep.get_executor(), late_gateway);
  {
    RecordingInstance listener;
    endpoints::ReplyEndpoint service(here, context.get_executor(), who, listener);
    ASSERT_TRUE(until([&] { return gateway.ready.contains(who.id); }));
    ASSERT_TRUE(service.publish(reply(who.id, 1)));
    ASSERT_TRUE(until_replies(1));
  }
  ASSERT_TRUE(until([&] { return gateway.gone == 1; }));
  EXPECT_TRUE(run_until(asleep, [&] { return late_gateway.replies.size() == 1; }));
  EXPECT_THAT(late_gateway.ignored, SizeIs(0));
}

}  // namespace
}  // namespace millrace::fabric
