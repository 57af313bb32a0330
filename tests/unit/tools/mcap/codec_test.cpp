// Each record is encoded and decoded; truncation is reported.
#include "tools/mcap/codec.hpp"

#include <gtest/gtest.h>

#include "tools/mcap/cursor.hpp"

namespace millrace::tools::mcap {
namespace {

template <typename Record>
std::string content_of(const Record& record) {
  std::string bytes;
  append(bytes, record);
  return bytes.substr(record_prefix_size);
}

template <typename Record>
Expected<Record> decoded(Bytes content, std::uint64_t offset = 0) {
  Cursor in(content, offset);
  return decode<Record>(in);
}

TEST(McapCodec, FramesARecordWithOpcodeAndLength) {
  std::string bytes;
  append(bytes, Header{"p", "lib"});
  EXPECT_EQ(bytes, std::string("\x01"                // Header
                               "\x0c\0\0\0\0\0\0\0"  // 12 bytes follow
                               "\x01\0\0\0p"         // profile
                               "\x03\0\0\0lib",
                               21));  // library
}

TEST(McapCodec, ReadsBackWhatItWrites) {
  const Channel channel{7, 3, "topic", "protobuf", {{"a", "1"}, {"b", ""}}};
  EXPECT_EQ(decoded<Channel>(content_of(channel)), channel);
  const Schema schema{3, "Name", "protobuf", std::string("\0\x01", 2)};
  EXPECT_EQ(decoded<Schema>(content_of(schema)), schema);
  const Statistics statistics{9, 1, 2, 3, 4, 5, 6, 7, {{1, 4}, {2, 5}}};
  EXPECT_EQ(decoded<Statistics>(content_of(statistics)), statistics);
  const Metadata metadata{"name", {{"key", "value"}}};
  EXPECT_EQ(decoded<Metadata>(content_of(metadata)), metadata);
}

TEST(McapCodec, ReadsBackAMessageWithAllItsTimes) {
  const std::string content =
      content_of(Message{0x1234, 0x89abcdef, 1'700'000'000'123'456'789, 5, "data"});
  const auto message = decoded<Message>(content);
  ASSERT_TRUE(message);
  EXPECT_EQ(message->channel, 0x1234);
  EXPECT_EQ(message->sequence, 0x89abcdefU);
  EXPECT_EQ(message->log_time, 1'700'000'000'123'456'789U);
  EXPECT_EQ(message->publish_time, 5U);
  EXPECT_EQ(message->data, "data");
}

TEST(McapCodec, SkipsFieldsThatALaterVersionAdded) {
  const Header header{"", "lib"};
  EXPECT_EQ(decoded<Header>(content_of(header) + "more"), header);
}

TEST(McapCodec, NamesThePlaceWhereARecordIsCut) {
  const std::string content = content_of(Channel{7, 3, "topic", "protobuf", {{"a", "1"}}});
  for (std::size_t size = 0; size < content.size(); ++size) {
    const auto cut = decoded<Channel>(content.substr(0, size), 100);
    ASSERT_FALSE(cut) << size;
    EXPECT_GE(cut.error().offset, 100U);
    EXPECT_LE(cut.error().offset, 100 + size);
  }
  EXPECT_EQ(decoded<Header>(Bytes("\x05\0\0\0abc", 7), 40).error().to_string(),
            "at byte 44: the Header record ends inside one of its fields");
}

TEST(McapCodec, RefusesSchemaZero) {
  const auto schema = decoded<Schema>(content_of(Schema{0, "Name", "", ""}), 12);
  ASSERT_FALSE(schema);
  EXPECT_EQ(schema.error().offset, 12U);
}

TEST(McapCodec, NoticesADamagedAttachment) {
  std::string content = content_of(Attachment{1, 2, "note", "text/plain", "text"});
  ASSERT_TRUE(decoded<Attachment>(content));
  content[content.size() - 6] ^= 1;
  const auto damaged = decoded<Attachment>(content);
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().text.find("'note' is damaged"), std::string::npos);
}

TEST(McapCursor, StopsForGoodWhereBytesAreMissing) {
  Cursor sut(Bytes("\x01\0\x02", 3), 10);
  EXPECT_EQ(sut.u16(), 1);
  EXPECT_EQ(sut.u32(), 0U);
  EXPECT_FALSE(sut.ok());
  EXPECT_EQ(sut.u8(), 0);
  EXPECT_EQ(sut.offset(), 12U);
}

}  // namespace
}  // namespace millrace::tools::mcap
