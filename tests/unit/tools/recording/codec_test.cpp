// Each kind of entry is encoded to its message and decoded.
#include "tools/recording/codec.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include "fabric/channel_scope.hpp"
#include "fabric/lcm/mirror.hpp"
#include "fabric/wire/topics.hpp"
#include "fabric/words.hpp"
#include "idl/recording.pb.h"
#include "tests/unit/tools/recording/one_call.hpp"
#include "tools/mcap/summary.hpp"
#include "tools/recording/lcm_log.hpp"
#include "tools/recording/reader.hpp"
#include "tools/recording/writer.hpp"

namespace millrace::tools::recording {
namespace {

using namespace std::string_literals;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using tests::at;
using tests::one_call;

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
  // Other programs read it as text too.
  millrace::recording::Request message;
  ASSERT_TRUE(message.ParseFromString(encode(sent)));
  EXPECT_EQ(message.uuid(), "prüfen");
  EXPECT_EQ(message.uuid_bytes(), uuid);
  Entry reply = one_call(1, 0)[3];
  reply.uuid = uuid;
  EXPECT_EQ(encoded_and_decoded(reply).uuid, uuid);
}

// The size of a nested message has one byte below 128 and two above.
TEST(RecordingCodec, KeepsNestedMessagesOfAnySize) {
  for (std::size_t size = 0; size <= 255; ++size) {
    fabric::DataSample sample;
    sample.key = {"press", 1};
    sample.values.resize(2);
    sample.values[0].reason = std::string(size, 'x');
    sample.values[1].name = "V.E.B";
    const Entry sent{.at = at(1), .sample = sample};
    ASSERT_EQ(std::get<fabric::DataSample>(encoded_and_decoded(sent).sample), sample) << size;
  }
}

// Two bytes of a file for each argument, and some 90 of memory.
TEST(RecordingCodec, ReadsEightArgumentsOfASentenceAndNoMore) {
  fabric::Event event{.key = {"press", 1}};
  event.detail = fabric::Message("text");
  event.detail.code = "many";
  event.detail.arguments.resize(9, fabric::Message("x"));
  const Entry sent{.at = at(1), .sample = event};
  const auto got = encoded_and_decoded(sent);
  EXPECT_EQ(std::get<fabric::Event>(got.sample).detail.arguments.size(), 8U);
}

TEST(RecordingCodec, KeepsTheElementsOfATypeOfALaterVersion) {
  fabric::DataSample sample{.key = {"press", 1}, .group = "axes"};
  sample.values.push_back({.name = "V.A.LATER", .type = static_cast<fabric::ValueType>(200)});
  sample.values.back().elements = std::vector<double>{1.5};
  const auto got = encoded_and_decoded({.at = at(1), .sample = sample});
  EXPECT_EQ(std::get<fabric::DataSample>(got.sample).values, sample.values);
}

TEST(RecordingCodec, ReadsNewValuesOfALaterVersionAsUnknown) {
  Entry sent = one_call(1, 0)[2];
  std::get<fabric::Event>(sent.sample).kind = static_cast<fabric::EventKind>(77);
  const auto got = encoded_and_decoded(sent);
  EXPECT_EQ(std::get<fabric::Event>(got.sample).kind, static_cast<fabric::EventKind>(77));
  EXPECT_EQ(name_of(std::get<fabric::Event>(got.sample).kind), "unknown (77)");
  Entry reply = one_call(1, 0)[3];
  std::get<fabric::Reply>(reply.sample).code = static_cast<fabric::ServiceCode>(77);
  EXPECT_EQ(name_of(std::get<fabric::Reply>(encoded_and_decoded(reply).sample).code),
            "unknown (77)");
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
  const auto expect_origin = [](const Sample& sample, const fabric::wire::Topic& topic) {
    const mcap::StringMap metadata = origin_metadata({.sample = sample});
    EXPECT_EQ(metadata.at("dds_topic"), topic.name);
    EXPECT_EQ(
        metadata.at("dds_qos"),
        fmt::format("{}, {}, keep last {}", topic.best_effort ? "best effort" : "reliable",
                    topic.transient_local ? "transient local" : "volatile", topic.writer_depth));
  };
  expect_origin(fabric::Request{}, fabric::wire::request_topic);
  expect_origin(fabric::Reply{}, fabric::wire::reply_topic);
  expect_origin(Withdrawal{}, fabric::wire::request_topic);
  expect_origin(fabric::ChannelStatus{}, fabric::wire::channel_topic);
  expect_origin(fabric::InstanceStatus{}, fabric::wire::heartbeat_topic);
  expect_origin(fabric::Event{}, fabric::wire::event_topic);
  expect_origin(fabric::Command{}, fabric::wire::command_topic);
  expect_origin(fabric::Outcome{}, fabric::wire::outcome_topic);
  expect_origin(fabric::MachineStatus{}, fabric::wire::machine_topic);
  expect_origin(fabric::DataSample{}, fabric::wire::data_topic);
  expect_origin(fabric::ProgramEvent{}, fabric::wire::program_topic);
  expect_origin(AlarmNews{}, fabric::wire::alarm_topic);
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

TEST(RecordingCodec, WritesNoEmptyLists) {
  const Entry empty{.sample = fabric::DataSample{}};
  const Entry value{.sample = fabric::DataSample{.values = {{.name = "X"}}}};
  // Of the value: its tag and size, and tag, size and bytes of its name.
  EXPECT_EQ(encode(value).size(), encode(empty).size() + 2 + 3);
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

// Entries are written to a file and read back.

/// Ten calls, one chunk each.
std::string ten_calls() {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  RecordingWriter sut(writer);
  for (std::uint64_t number = 1; number <= 10; ++number) {
    for (const Entry& entry : one_call(number, static_cast<double>(number) * 100)) {
      EXPECT_TRUE(sut.write(entry));
    }
    EXPECT_TRUE(writer.close_chunk());
  }
  EXPECT_TRUE(writer.close());
  return file.bytes();
}

std::vector<Entry> read(mcap::Source& file, const Filter& filter) {
  std::vector<Entry> entries;
  const ReadReport report =
      read_entries(file, filter, [&](const Entry& entry) { entries.push_back(entry); });
  EXPECT_EQ(report.problems, mcap::Problems{});
  EXPECT_EQ(report.foreign, 0U);
  return entries;
}

TEST(RecordingWriter, WritesWhatTheReaderReads) {
  mcap::Memory file(ten_calls());
  const std::vector<Entry> entries = read(file, {});
  ASSERT_EQ(entries.size(), 70U);
  EXPECT_EQ(kind_of(entries[1]), "request");
  EXPECT_EQ(entries[1].at, at(101.1));
  EXPECT_EQ(call_of(entries[69]), (fabric::CallId{0x5f, 10}));
}

TEST(RecordingWriter, NamesChannelsByWhatHappened) {
  mcap::Memory file(ten_calls());
  const auto summary = mcap::read_summary(file);
  ASSERT_TRUE(summary);
  std::map<std::string, std::uint64_t> counts;
  for (const auto& [id, channel] : summary->definitions.channels()) {
    counts[channel.topic] = summary->statistics.channel_messages.at(id);
    EXPECT_EQ(channel.message_encoding, "protobuf");
    EXPECT_TRUE(channel.metadata.at("dds_topic").starts_with("millrace/"));
  }
  EXPECT_EQ(counts, (std::map<std::string, std::uint64_t>{{"machine/cnc/1/event", 40},
                                                          {"machine/cnc/1/reply", 10},
                                                          {"machine/cnc/1/request", 10},
                                                          {"machine/cnc/1/withdrawal", 10}}));
}

TEST(RecordingReader, ReadsOnlyTheChunksOfTheSelectedTime) {
  class Counting : public mcap::Memory {
   public:
    using Memory::Memory;
    void read(std::uint64_t offset, std::uint64_t length, std::string& out) override {
      Memory::read(offset, length, out);
      largest = std::max(largest, out.size());
      total += out.size();
    }
    std::size_t largest = 0;
    std::size_t total = 0;
  };
  Counting all(ten_calls());
  EXPECT_EQ(read(all, {}).size(), 70U);
  Counting some(ten_calls());
  EXPECT_EQ(read(some, {.from = at(500), .to = at(599)}).size(), 7U);
  EXPECT_LT(some.total, all.total);
}

TEST(RecordingReader, CountsForeignMessages) {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  writer.define(mcap::Channel{1, 0, "other/topic", "json", {}});
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "{}"}));
  ASSERT_TRUE(writer.close());
  const ReadReport report = read_entries(file, {}, [](const Entry&) { FAIL(); });
  EXPECT_EQ(report.foreign, 1U);
}

TEST(RecordingReader, NamesAMessageThatIsDamaged) {
  mcap::Memory file;
  mcap::Writer writer(file, {});
  writer.define(mcap::Schema{1, "millrace.recording.Request", "protobuf", "x"});
  writer.define(mcap::Channel{1, 1, "machine/cnc/1/request", "protobuf", {}});
  ASSERT_TRUE(writer.write({1, 1, 1, 1, "\xff"}));
  ASSERT_TRUE(writer.close());
  const ReadReport report = read_entries(file, {}, [](const Entry&) { FAIL(); });
  ASSERT_EQ(report.problems.size(), 1U);
  EXPECT_EQ(report.problems[0].text, "the message is not a millrace.recording.Request");
  EXPECT_GT(report.problems[0].offset, 8U);
}

std::string big(std::uint64_t number, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) {
    text.push_back(static_cast<char>(number >> (8 * i)));
  }
  return text;
}

std::string event(const std::string& channel, const std::string& message) {
  return "\xED\xA1\xDA\x01"s + big(1, 8) + big(2, 8) + big(channel.size(), 4) +
         big(message.size(), 4) + channel + message;
}

std::string mirrored(std::uint64_t number) {
  const auto message = fabric::lcm::mirrored(
      {.at = fabric::Time(std::chrono::nanoseconds(number)),
       .uuid = "u",
       .sample = fabric::Request{
           .key = {"cnc", 1}, .call = {5, number}, .uuid = "u", .text = "text", .state = 1}});
  return event(message->channel, message->bytes);
}

struct Read {
  ReadReport report;
  std::vector<std::uint64_t> numbers;
};

Read read(const std::string& bytes, const Filter& filter = {}) {
  mcap::Memory file(bytes);
  Read read;
  read.report = read_entries(
      file, filter, [&](const Entry& entry) { read.numbers.push_back(call_of(entry).number); });
  return read;
}

TEST(LcmLog, IsReadAsARecording) {
  const Read sut = read(mirrored(1) + event("CAMERA", std::string(100'000, 'p')) + mirrored(2) +
                        event("MILLRACE_PRESENCE", "x") + mirrored(3));
  EXPECT_THAT(sut.numbers, ElementsAre(1, 2, 3));
  EXPECT_THAT(sut.report.problems.described(), IsEmpty());
  EXPECT_EQ(sut.report.foreign, 2U);
  EXPECT_THAT(read(mirrored(1) + mirrored(2), {.call = fabric::CallId{5, 2}}).numbers,
              ElementsAre(2));
}

TEST(LcmLog, ThatIsCutOffIsReadUpToThere) {
  const std::string whole = mirrored(1) + mirrored(2);
  for (std::size_t size = mirrored(1).size() + 1; size < whole.size(); ++size) {
    const Read sut = read(whole.substr(0, size));
    ASSERT_THAT(sut.numbers, ElementsAre(1)) << size;
    ASSERT_THAT(sut.report.problems.described(), SizeIs(1)) << size;
    EXPECT_EQ(sut.report.problems[0].offset, mirrored(1).size());
  }
}

TEST(LcmLog, IsReadAfterADamagedPlace) {
  const Read torn = read(mirrored(1) + "torn"s + mirrored(2));
  EXPECT_THAT(torn.numbers, ElementsAre(1, 2));
  EXPECT_THAT(torn.report.problems[0].text, HasSubstr("4 bytes are skipped"));
  std::string huge = mirrored(1);
  huge[24] = '\x7F';
  const Read sut = read(huge + mirrored(2));
  EXPECT_THAT(sut.numbers, ElementsAre(2));
  EXPECT_THAT(sut.report.problems[0].text, HasSubstr("after the end of the file"));
}

TEST(LcmLog, IsALogWithoutTheBeginOfItsFirstEvent) {
  const std::string whole = mirrored(1) + mirrored(2) + mirrored(3);
  for (std::size_t cut = 1; cut < mirrored(1).size(); ++cut) {
    const Read sut = read(whole.substr(cut));
    ASSERT_THAT(sut.numbers, ElementsAre(2, 3)) << cut;
    ASSERT_THAT(sut.report.problems.described(), SizeIs(1)) << cut;
  }
}

TEST(LcmLog, HasNothingReadableIfItsOnlyEventIsCut) {
  const std::string whole = mirrored(1);
  for (std::size_t size = 5; size < whole.size(); ++size) {
    const Read sut = read(whole.substr(0, size));
    ASSERT_FALSE(sut.report.has_read) << size;
    ASSERT_THAT(sut.report.problems.described(), SizeIs(1)) << size;
  }
}

TEST(LcmLog, HasASurvey) {
  mcap::Memory file(mirrored(1) + event("CAMERA", std::string(100'000, 'p')) + mirrored(2));
  const mcap::Survey sut = recording::survey(file);
  EXPECT_TRUE(sut.closed);
  EXPECT_EQ(sut.summary.statistics.messages, 3U);
  EXPECT_EQ(sut.summary.statistics.start, 2000U);
  ASSERT_EQ(sut.summary.definitions.channels().size(), 2U);
  EXPECT_EQ(sut.summary.definitions.channel(1)->topic, "CAMERA");
}

TEST(LcmLog, IsRepairedByTheCopyOfItsWholeEvents) {
  const std::string camera = event("CAMERA", std::string(3'000'000, 'p'));
  mcap::Memory damaged("torn" + mirrored(1) + "torn" + camera + mirrored(2).substr(0, 40));
  mcap::Memory repaired;
  const auto report = repair_lcm_log(damaged, repaired);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->saved.messages, 2U);
  EXPECT_EQ(report->problems.size(), 2U) << "the first two are equal";
  EXPECT_TRUE(repaired.bytes() == mirrored(1) + camera);
}

TEST(LcmLog, ReportsInvalidMirrorMessages) {
  const Read sut = read(mirrored(1) + event("MILLRACE_MIRROR.request", "nonsense!"));
  EXPECT_THAT(sut.numbers, ElementsAre(1));
  EXPECT_THAT(sut.report.problems[0].text, HasSubstr("on MILLRACE_MIRROR.request: "));
}

}  // namespace
}  // namespace millrace::tools::recording
