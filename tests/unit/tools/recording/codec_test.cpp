// Each kind of entry to its message and back.
#include "tools/recording/codec.hpp"

#include <fmt/format.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include "fabric/channel_scope.hpp"
#include "fabric/wire/data_topics.hpp"
#include "fabric/wire/notice_codec.hpp"
#include "fabric/wire/topics.hpp"
#include "fabric/words.hpp"
#include "idl/recording.pb.h"
#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/recording/channels.hpp"

namespace millrace::tools::recording {
namespace {

using tests::at;
using tests::one_call;
using tests::square_root;

Entry there_and_back(const Entry& entry) {
  const auto decoded = decode(schema_name(entry), encode(entry), entry.at);
  EXPECT_TRUE(decoded) << decoded.error();
  return decoded.value_or(Entry{});
}

fabric::InstanceId instance(std::uint8_t byte) {
  fabric::InstanceId id;
  id.bytes.fill(byte);
  return id;
}

TEST(RecordingCodec, KeepsARequest) {
  const Entry sent = one_call(17, 0)[1];
  const Entry got = there_and_back(sent);
  EXPECT_EQ(got.at, sent.at);
  EXPECT_EQ(got.uuid, square_root);
  const auto& request = std::get<fabric::Request>(got.sample);
  const auto& original = std::get<fabric::Request>(sent.sample);
  EXPECT_EQ(request.key, original.key);
  EXPECT_EQ(request.call, original.call);
  EXPECT_EQ(request.assigned, original.assigned);
  EXPECT_EQ(request.text, "2");
  EXPECT_EQ(request.state, 1U);
  EXPECT_EQ(request.seen, original.seen);
  EXPECT_EQ(request.dispatched, original.dispatched);
}

TEST(RecordingCodec, KeepsAReply) {
  Entry sent = one_call(17, 0)[3];
  std::get<fabric::Reply>(sent.sample).code = fabric::ServiceCode::repeated;
  std::get<fabric::Reply>(sent.sample).kind = fabric::ReplyKind::interim;
  std::get<fabric::Reply>(sent.sample).replayed = true;
  const Entry got = there_and_back(sent);
  EXPECT_EQ(got.uuid, square_root);
  const auto& reply = std::get<fabric::Reply>(got.sample);
  EXPECT_EQ(reply.text, "1.414214");
  EXPECT_EQ(reply.code, fabric::ServiceCode::repeated);
  EXPECT_EQ(reply.kind, fabric::ReplyKind::interim);
  EXPECT_TRUE(reply.replayed);
  EXPECT_EQ(reply.received, at(1.5));
  EXPECT_EQ(reply.answered, at(4.6));
}

TEST(RecordingCodec, KeepsBytesThatAreNoUtf8) {
  Entry sent = one_call(17, 0)[1];
  std::get<fabric::Request>(sent.sample).text = std::string("\xDF\0\x80", 3);
  EXPECT_EQ(*text_of(there_and_back(sent)), std::string("\xDF\0\x80", 3));
}

TEST(RecordingCodec, KeepsTheBytesOfAUuidThatIsNoUtf8) {
  const std::string uuid =
      "pr\xfc"
      "fen";
  Entry sent = one_call(1, 0)[1];
  sent.uuid = uuid;
  std::get<fabric::Request>(sent.sample).uuid = uuid;
  const Entry request = there_and_back(sent);
  EXPECT_EQ(request.uuid, uuid);
  EXPECT_EQ(std::get<fabric::Request>(request.sample).uuid, uuid);
  Entry reply = one_call(1, 0)[3];
  reply.uuid = uuid;
  EXPECT_EQ(there_and_back(reply).uuid, uuid);
}

TEST(RecordingCodec, TakesWhatANewerVersionSaysForUnknownAndNotForTheFirst) {
  Entry sent = one_call(1, 0)[2];
  std::get<fabric::Event>(sent.sample).kind = static_cast<fabric::EventKind>(77);
  EXPECT_EQ(name_of(std::get<fabric::Event>(there_and_back(sent).sample).kind), "unknown");
  Entry reply = one_call(1, 0)[3];
  std::get<fabric::Reply>(reply.sample).code = static_cast<fabric::ServiceCode>(77);
  EXPECT_EQ(name_of(std::get<fabric::Reply>(there_and_back(reply).sample).code), "unknown");
}

TEST(RecordingCodec, TakesNoChannelForOneThatItCannotRead) {
  millrace::recording::Instance message;
  message.add_channel("cnc");
  const auto entry =
      decode("millrace.recording.Instance", message.SerializeAsString(), fabric::Time{});
  ASSERT_TRUE(entry);
  const auto& channels = std::get<InstanceNews>(entry->sample).identity.channels;
  ASSERT_EQ(channels.size(), 1U) << "it would seem to take every channel";
  EXPECT_FALSE(fabric::is_machine_name(channels[0].machine));
}

TEST(RecordingCodec, SaysInAFileHowItsSamplesTravel) {
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
  says(fabric::InstanceStatus{}, fabric::wire::beat_topic);
  says(fabric::Event{}, fabric::wire::event_topic);
  says(fabric::Command{}, fabric::wire::command_topic);
  says(fabric::Outcome{}, fabric::wire::outcome_topic);
  says(fabric::MachineStatus{}, fabric::wire::machine_topic);
  says(fabric::DataSample{}, fabric::wire::data_topic);
  says(fabric::ProgramEvent{}, fabric::wire::program_topic);
  says(NoticeNews{}, fabric::wire::notice_topic);
}

TEST(RecordingCodec, KeepsOnlyTheSizeOfAWithheldText) {
  Entry sent = one_call(17, 0)[1];
  std::get<fabric::Request>(sent.sample).text = "secret";
  withhold_text(sent);
  EXPECT_EQ(encode(sent).find("secret"), std::string::npos);
  const Entry got = there_and_back(sent);
  EXPECT_EQ(got.withheld, 6U);
  EXPECT_EQ(*text_of(got), "");
}

TEST(RecordingCodec, KeepsAnInstance) {
  const Entry sent{.at = at(0),
                   .uuid = square_root,
                   .sample = InstanceNews{Change::changed,
                                          {.id = instance(3),
                                           .uuid = square_root,
                                           .name = "square_root",
                                           .description = "roots",
                                           .version = "1.2.3",
                                           .host = "host7",
                                           .pid = 4711,
                                           .channels = {{"cnc", 1}, {"", 2}, {"cnc", 0}},
                                           .delivery = fabric::Delivery::at_most_once,
                                           .awaited = fabric::Awaited::response,
                                           .concurrency = 4,
                                           .draining = true}}};
  const Entry got = there_and_back(sent);
  const auto& news = std::get<InstanceNews>(got.sample);
  EXPECT_EQ(news.change, Change::changed);
  EXPECT_EQ(news.identity, std::get<InstanceNews>(sent.sample).identity);
}

TEST(RecordingCodec, KeepsTheStatusOfAChannel) {
  const Entry sent{.at = at(1),
                   .uuid = square_root,
                   .sample = fabric::ChannelStatus{.key = {"cnc", 3},
                                                   .state = fabric::ChannelState::held,
                                                   .since = at(0),
                                                   .call = {7, 8},
                                                   .attempt = 2,
                                                   .instance = instance(9),
                                                   .uuid = square_root,
                                                   .reason = "lost",
                                                   .calls = 1,
                                                   .answered = 2,
                                                   .withdrawn = 3,
                                                   .repeated = 4,
                                                   .late = 5,
                                                   .failed = 6}};
  const auto status = std::get<fabric::ChannelStatus>(there_and_back(sent).sample);
  EXPECT_EQ(status.state, fabric::ChannelState::held);
  EXPECT_EQ(status.since, at(0));
  EXPECT_EQ(status.reason, "lost");
  EXPECT_EQ(status.instance, instance(9));
  EXPECT_EQ(status.repeated, 4U);
  EXPECT_EQ(status.failed, 6U);
}

TEST(RecordingCodec, KeepsDataAndProgramEvents) {
  const fabric::DataSample data{.key = {"press", 2},
                                .group = "axes",
                                .at = at(1),
                                .period = std::chrono::milliseconds(200),
                                .wanted = std::chrono::milliseconds(100),
                                .values = {{.name = "V.A.ACT_POS.X",
                                            .type = fabric::ValueType::real64,
                                            .at = at(1),
                                            .elements = std::vector<double>{-0.25}},
                                           {.name = "V.E.T",
                                            .type = fabric::ValueType::string,
                                            .quality = fabric::Quality::stale,
                                            .is_array = true,
                                            .elements = std::vector<std::string>{"\xDF", ""},
                                            .reason = "the link is down"},
                                           {.name = "V.E.N",
                                            .type = fabric::ValueType::sgn32,
                                            .elements = std::vector<std::int64_t>{-7}}},
                                .replayed = true};
  const Entry sample{.at = at(2), .sample = data};
  EXPECT_EQ(std::get<fabric::DataSample>(there_and_back(sample).sample), data);
  EXPECT_EQ(topic_of(sample), "machine/press/2/data/axes");

  const fabric::ProgramEvent ended{.key = {"press", 2},
                                   .kind = fabric::ProgramEventKind::ended,
                                   .at = at(3),
                                   .started = at(1),
                                   .program = "wei\xDF.nc",
                                   .parts = -3,
                                   .mode = 2,
                                   .detail = "x"};
  const Entry event{.at = at(3), .sample = ended};
  EXPECT_EQ(std::get<fabric::ProgramEvent>(there_and_back(event).sample), ended);
  EXPECT_EQ(topic_of(event), "machine/press/2/program");
}

TEST(RecordingCodec, KeepsWhatAProgramSaysOfItself) {
  const fabric::Notice notice{.key = {instance(3), "archive", "main"},
                              .level = fabric::NoticeLevel::warning,
                              .text = "the disk is almost full",
                              .advice = "make room",
                              .since = at(1),
                              .program = "millrace-archiver",
                              .host = "cell-7",
                              .pid = 17};
  const Entry said{.at = at(2), .sample = NoticeNews{.notice = notice}};
  EXPECT_EQ(std::get<NoticeNews>(there_and_back(said).sample).notice, notice);
  EXPECT_FALSE(std::get<NoticeNews>(there_and_back(said).sample).over);
  EXPECT_EQ(topic_of(said), "program/millrace-archiver/notice");
  const Entry over{.at = at(3), .sample = NoticeNews{.over = true, .notice = notice}};
  EXPECT_TRUE(std::get<NoticeNews>(there_and_back(over).sample).over);
  EXPECT_EQ(origin_of(over), at(3));
  EXPECT_EQ(origin_of(said), at(1));
}

TEST(RecordingCodec, KeepsCommandAndOutcome) {
  const Entry command{.at = at(1),
                      .sample = fabric::Command{.id = instance(1),
                                                .kind = fabric::CommandKind::retry,
                                                .key = {"cnc", 1},
                                                .call = {7, 8},
                                                .issuer = "operator@host",
                                                .at = at(0.5)}};
  const auto got = std::get<fabric::Command>(there_and_back(command).sample);
  EXPECT_EQ(got.id, instance(1));
  EXPECT_EQ(got.kind, fabric::CommandKind::retry);
  EXPECT_EQ(got.issuer, "operator@host");
  const Entry outcome{
      .at = at(2),
      .sample = fabric::Outcome{.responder = instance(4), .command = instance(1), .done = true}};
  EXPECT_EQ(std::get<fabric::Outcome>(there_and_back(outcome).sample).command, instance(1));
}

TEST(RecordingCodec, KeepsTheStatusOfAMachine) {
  const fabric::MachineStatus status{.machine = "cnc",
                                     .gateway = instance(7),
                                     .claimed = at(2),
                                     .claims = {1, 3},
                                     .connected = true,
                                     .since = at(0),
                                     .address = "10.0.0.5:48898",
                                     .reason = "r",
                                     .channels = 2,
                                     .poll = std::chrono::milliseconds(10),
                                     .requests_per_second = 7,
                                     .round_trip = std::chrono::microseconds(300),
                                     .host = "host",
                                     .pid = 1,
                                     .version = "0.1.0",
                                     .epoch = 5};
  EXPECT_EQ(std::get<fabric::MachineStatus>(there_and_back({.at = at(1), .sample = status}).sample),
            status);
}

TEST(RecordingCodec, SaysWhatIsNotOurs) {
  EXPECT_EQ(decode("foxglove.Log", "", at(0)).error(), "'foxglove.Log' is no schema of millrace");
  EXPECT_EQ(decode("millrace.recording.Event", "\xff", at(0)).error(),
            "the message is no millrace.recording.Event");
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
