// Each record is encoded and decoded; truncation is reported.
#include "tools/mcap/codec.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/mcap/compression.hpp"

namespace millrace::tools::mcap {
namespace {

using testing::HasSubstr;
using testing::Lt;

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
  EXPECT_EQ(sut.integer(2), 1U);
  EXPECT_EQ(sut.u32(), 0U);
  EXPECT_FALSE(sut.ok());
  EXPECT_EQ(sut.u8(), 0);
  EXPECT_EQ(sut.offset(), 12U);
}

// Compressed records are encoded and decoded, also those of other programs.

/// Bytes that repeat after a while, but not within that time.
std::string sample(std::size_t size) {
  std::string bytes;
  std::uint32_t state = 1;
  while (bytes.size() < size) {
    state = state * 1664525U + 1013904223U;
    bytes += "a part that all have in common, and ";
    bytes += std::to_string(state);
  }
  bytes.resize(size);
  return bytes;
}

class McapCompression : public testing::TestWithParam<Compression> {
 protected:
  tl::expected<void, std::string> unpack(const std::string& packed, std::uint64_t size) {
    return decompress(GetParam(), packed, size, records);
  }

  std::string records = "what was there before";
};

INSTANTIATE_TEST_SUITE_P(Each, McapCompression,
                         testing::Values(Compression::lz4, Compression::zstd),
                         [](const auto& of) { return std::string(name_of(of.param)); });

TEST_P(McapCompression, RestoresWhatItCompressed) {
  for (const std::size_t size : {0U, 1U, 100U, 65'536U, 1'000'000U, 20'000'000U}) {
    const std::string bytes = sample(size);
    const std::string packed = compress(GetParam(), bytes);
    ASSERT_TRUE(unpack(packed, size)) << size;
    EXPECT_EQ(records, bytes) << size;
    EXPECT_THAT(packed.size(), Lt(size / 2 + 100));
  }
}

TEST_P(McapCompression, RefusesAnotherSizeThanAnnounced) {
  const std::string packed = compress(GetParam(), sample(1000));
  EXPECT_THAT(unpack(packed, 1001).error(), HasSubstr("has fewer bytes than the chunk declares"));
  EXPECT_FALSE(unpack(packed, 999));
  EXPECT_FALSE(unpack(packed, 0));
}

TEST_P(McapCompression, RefusesWhatIsCutAnywhere) {
  const std::string packed = compress(GetParam(), sample(1000));
  for (std::size_t size = 0; size < packed.size(); ++size) {
    EXPECT_FALSE(unpack(packed.substr(0, size), 1000)) << size;
  }
}

TEST_P(McapCompression, RefusesBytesAfterTheEnd) {
  const std::string packed = compress(GetParam(), sample(1000));
  EXPECT_THAT(unpack(packed + "x", 1000).error(), HasSubstr("bytes after its end"));
  EXPECT_FALSE(unpack(packed + packed, 1000));
}

TEST_P(McapCompression, RefusesGarbage) {
  EXPECT_FALSE(unpack("garbage", 1000));
  EXPECT_FALSE(unpack(std::string(100'000, '\xFD'), 1000));
}

TEST_P(McapCompression, AllocatesNoMoreMemoryThanItFills) {
  const std::string packed = compress(GetParam(), sample(10'000));
  records = {};
  records.shrink_to_fit();
  EXPECT_FALSE(unpack(packed, largest_uncompressed));
  EXPECT_LT(records.capacity(), 200'000U);
  EXPECT_FALSE(unpack("garbage", largest_uncompressed));
  EXPECT_LT(records.capacity(), 200'000U);
}

TEST_P(McapCompression, ReadsNothingThatWouldBeTooLarge) {
  EXPECT_THAT(unpack(compress(GetParam(), "x"), largest_uncompressed + 1).error(),
              HasSubstr("exceed the size limit"));
}

// A frame header of Zstandard that asks for a window of 2 GiB, and a block of one byte.
TEST(McapCompressionZstd, GivesAFrameNoLargerWindowThanItsContentCanUse) {
  const std::string packed("\x28\xB5\x2F\xFD\x00\xA8\x09\x00\x00x", 10);
  std::string records;
  const auto done = decompress(Compression::zstd, packed, 1, records);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error(), HasSubstr("memory"));
}

TEST(McapCompressionName, IsThatOfChunks) {
  EXPECT_EQ(compression_of(""), Compression::none);
  EXPECT_EQ(compression_of("lz4"), Compression::lz4);
  EXPECT_EQ(compression_of("zstd"), Compression::zstd);
  EXPECT_EQ(compression_of("brotli"), std::nullopt);
}

}  // namespace
}  // namespace millrace::tools::mcap
