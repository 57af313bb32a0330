// Each kind of entry is encoded to its message and decoded.
#include "tools/recording/codec.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include "fabric/channel_scope.hpp"
#include "fabric/wire/topics.hpp"
#include "fabric/words.hpp"
#include "idl/recording.pb.h"
#include "tests/unit/tools/recording/one_call.hpp"

namespace millrace::tools::recording {
namespace {

using tests::at;
using tests::one_call;
using tests::square_root;

Entry encoded_and_decoded(const Entry& entry) {
  const auto decoded = decode(schema_name(entry), encode(entry), entry.at);
  EXPECT_TRUE(decoded) << decoded.error();
  return decoded.value_or(Entry{});
}

TEST(RecordingCodec, KeepsBytesThatAreNoUtf8) {
  Entry sent = one_call(17, 0)[1];
  std::get<fabric::Request>(sent.sample).text = std::string("\xDF\0\x80", 3);
  EXPECT_EQ(*text_of(encoded_and_decoded(sent)), std::string("\xDF\0\x80", 3));
}

TEST(RecordingCodec, KeepsTheBytesOfAUuidThatIsNoUtf8) {
  const std::string uuid =
      "pr\xfc"
      "fen";
  Entry sent = one_call(1, 0)[1];
  sent.uuid = uuid;
  std::get<fabric::Request>(sent.sample).uuid = uuid;
  const Entry request = encoded_and_decoded(sent);
  EXPECT_EQ(request.uuid, uuid);
  EXPECT_EQ(std::get<fabric::Request>(request.sample).uuid, uuid);
  Entry reply = one_call(1, 0)[3];
  reply.uuid = uuid;
  EXPECT_EQ(encoded_and_decoded(reply).uuid, uuid);
}

TEST(RecordingCodec, ReadsNewValuesOfALaterVersionAsUnknown) {
  Entry sent = one_call(1, 0)[2];
  std::get<fabric::Event>(sent.sample).kind = static_cast<fabric::EventKind>(77);
  EXPECT_EQ(name_of(std::get<fabric::Event>(encoded_and_decoded(sent).sample).kind), "unknown");
  Entry reply = one_call(1, 0)[3];
  std::get<fabric::Reply>(reply.sample).code = static_cast<fabric::ServiceCode>(77);
  EXPECT_EQ(name_of(std::get<fabric::Reply>(encoded_and_decoded(reply).sample).code), "unknown");
}

TEST(RecordingCodec, DoesNotWidenAChannelScopeThatItCannotRead) {
  millrace::recording::Instance message;
  message.add_channel("cnc");
  const auto entry =
      decode("millrace.recording.Instance", message.SerializeAsString(), fabric::Time{});
  ASSERT_TRUE(entry);
  const auto& channels = std::get<InstanceNews>(entry->sample).identity.channels;
  ASSERT_EQ(channels.size(), 1U) << "it would seem to take every channel";
  EXPECT_FALSE(fabric::is_machine_name(channels[0].machine));
}

TEST(RecordingCodec, RecordsTopicAndQosOfItsSamples) {
  const auto says = [](const Sample& sample, const fabric::wire::Topic& topic) {
    const mcap::StringMap said = origin_metadata({.sample = sample});
    EXPECT_EQ(said.at("dds_topic"), topic.name);
    EXPECT_EQ(
        said.at("dds_qos"),
        fmt::format("{}, {}, keep last {}", topic.best_effort ? "best effort" : "reliable",
                    topic.transient_local ? "transient local" : "volatile", topic.writer_depth));
  };
  says(fabric::Request{}, fabric::wire::request_topic);
  says(fabric::Reply{}, fabric::wire::reply_topic);
  says(Withdrawal{}, fabric::wire::request_topic);
  says(fabric::ChannelStatus{}, fabric::wire::channel_topic);
  says(fabric::InstanceStatus{}, fabric::wire::heartbeat_topic);
  says(fabric::Event{}, fabric::wire::event_topic);
  says(fabric::Command{}, fabric::wire::command_topic);
  says(fabric::Outcome{}, fabric::wire::outcome_topic);
  says(fabric::MachineStatus{}, fabric::wire::machine_topic);
  says(fabric::DataSample{}, fabric::wire::data_topic);
  says(fabric::ProgramEvent{}, fabric::wire::program_topic);
  says(AlarmNews{}, fabric::wire::alarm_topic);
}

TEST(RecordingCodec, KeepsOnlyTheSizeOfAWithheldText) {
  Entry sent = one_call(17, 0)[1];
  std::get<fabric::Request>(sent.sample).text = "secret";
  withhold_text(sent);
  EXPECT_EQ(encode(sent).find("secret"), std::string::npos);
  const Entry got = encoded_and_decoded(sent);
  EXPECT_EQ(got.withheld, 6U);
  EXPECT_EQ(*text_of(got), "");
}

TEST(RecordingCodec, KeepsANumberOfPartsThatIsZero) {
  const Entry none{.sample = fabric::ProgramEvent{}};
  const Entry zero{.sample = fabric::ProgramEvent{.parts = 0}};
  EXPECT_EQ(encoded_and_decoded(none), none);
  EXPECT_EQ(encoded_and_decoded(zero), zero);
}

TEST(RecordingCodec, ReadsAbsentNumbersAsZero) {
  const auto reply = decode("millrace.recording.Reply", "", at(0));
  ASSERT_TRUE(reply);
  EXPECT_EQ(std::get<fabric::Reply>(reply->sample).attempt, 0U);
  EXPECT_EQ(std::get<fabric::Reply>(reply->sample).kind, fabric::ReplyKind::interim);
}

/// A name may change, its number in existing recordings not.
TEST(RecordingCodec, ReadsTheNumbersOfExistingRecordings) {
  const auto program = decode("millrace.recording.ProgramEvent",
                              std::string_view("\x0a\x05press\x10\x02\x18\x04"), at(0));
  ASSERT_TRUE(program);
  const auto& event = std::get<fabric::ProgramEvent>(program->sample);
  EXPECT_EQ(event.key, (fabric::ChannelKey{"press", 2}));
  EXPECT_EQ(event.kind, fabric::ProgramEventKind::on_hold);
  EXPECT_EQ(name_of(event.kind), "on hold");
}

TEST(RecordingCodec, SkipsAFieldOfAnotherType) {
  // Number, bytes and message, each in place of another.
  for (const std::string bytes : {"\x08\x05", "\x12\x01x", "\x18\x07", "\x28\x01", "\x4a\x01y"}) {
    const auto request = decode("millrace.recording.Request", bytes, at(0));
    ASSERT_TRUE(request);
    EXPECT_EQ(std::get<fabric::Request>(request->sample), fabric::Request{.attempt = 0});
  }
}

TEST(RecordingCodec, NamesTheStreamsOfDataProgramsAndAlarms) {
  const fabric::ChannelKey key{"press", 2};
  EXPECT_EQ(topic_of({.sample = fabric::DataSample{.key = key, .group = "axes"}}),
            "machine/press/2/data/axes");
  EXPECT_EQ(topic_of({.sample = fabric::ProgramEvent{.key = key}}), "machine/press/2/program");
  EXPECT_EQ(topic_of({.sample = AlarmNews{.alarm = {.program = "millrace-archiver"}}}),
            "program/millrace-archiver/alarm");
}

TEST(RecordingCodec, DatesAnAlarmByItsBeginning) {
  Entry entry{.at = at(3), .sample = AlarmNews{.alarm = {.since = at(1)}}};
  EXPECT_EQ(origin_of(entry), at(1));
  std::get<AlarmNews>(entry.sample).over = true;
  EXPECT_EQ(origin_of(entry), at(3));
}

TEST(RecordingCodec, ReportsForeignAndInvalidMessages) {
  EXPECT_EQ(decode("foxglove.Log", "", at(0)).error(),
            "'foxglove.Log' is not a schema of millrace");
  EXPECT_EQ(decode("millrace.recording.Event", "\xff", at(0)).error(),
            "the message is not a millrace.recording.Event");
}

TEST(RecordingCodec, DescribesEveryMessageInItsSchema) {
  google::protobuf::FileDescriptorSet set;
  ASSERT_TRUE(set.ParseFromString(descriptor_set()));
  ASSERT_EQ(set.file_size(), 1);
  EXPECT_EQ(set.file(0).package(), "millrace.recording");
  EXPECT_EQ(set.file(0).dependency_size(), 0);
}

}  // namespace
}  // namespace millrace::tools::recording
