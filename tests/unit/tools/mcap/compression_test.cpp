// Compressed records are encoded and decoded, also those of other programs.
#include "tools/mcap/compression.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace millrace::tools::mcap {
namespace {

using testing::HasSubstr;
using testing::Lt;

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
