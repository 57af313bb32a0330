// Reading files that are damaged, foreign or empty.
#include <gtest/gtest.h>

#include "tests/support/power_cut_disk.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/tools/mcap/sample_file.hpp"
#include "tools/mcap/codec.hpp"
#include "tools/mcap/compression.hpp"
#include "tools/mcap/file.hpp"
#include "tools/mcap/repair.hpp"
#include "tools/mcap/summary.hpp"

namespace millrace::tools::mcap {
namespace {

using tests::Read;
using tests::sample_file;
using tests::scan_all;

/// Whether `part` is `whole` without at most one of its chunks.
bool misses_at_most_one_chunk(const std::vector<Read>& part, const tests::SampleFile& sample) {
  for (std::size_t missing = 0; missing <= sample.chunks.size(); ++missing) {
    std::vector<Read> expected;
    for (std::size_t i = 0; i < sample.chunks.size(); ++i) {
      if (i != missing) {
        expected.insert(expected.end(), sample.chunks[i].begin(), sample.chunks[i].end());
      }
    }
    if (part == expected) {
      return true;
    }
  }
  return false;
}

class McapDamageOf : public testing::TestWithParam<Compression> {};

INSTANTIATE_TEST_SUITE_P(Each, McapDamageOf,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& of) {
                           return of.param == Compression::none ? "none"
                                                                : std::string(name_of(of.param));
                         });

TEST_P(McapDamageOf, AFlippedBitCostsAtMostOneChunkAndIsReported) {
  const auto sample = sample_file(4, 3, GetParam());
  for (std::size_t bit = 0; bit < sample.bytes.size() * 8; ++bit) {
    std::string bytes = sample.bytes;
    bytes[bit / 8] = static_cast<char>(bytes[bit / 8] ^ (1 << (bit % 8)));
    Memory file(bytes);
    const auto scanned = scan_all(file);
    ASSERT_TRUE(misses_at_most_one_chunk(scanned.messages, sample)) << "bit " << bit;
    ASSERT_FALSE(scanned.problems.empty() && read_summary(file)) << "bit " << bit;
  }
}

/// A file of `size` bytes, with zeros after its beginning, that counts the bytes read.
class Large : public Source {
 public:
  Large(std::string beginning, std::uint64_t size)
      : beginning_(std::move(beginning)), size_(size) {}

  [[nodiscard]] std::uint64_t size() const override { return size_; }
  void read(std::uint64_t offset, std::uint64_t length, std::string& out) override {
    const std::uint64_t there = std::min(length, size_ - std::min(offset, size_));
    out.assign(static_cast<std::size_t>(there), '\0');
    if (offset < beginning_.size()) {
      beginning_.copy(out.data(), out.size(), static_cast<std::size_t>(offset));
    }
    largest = std::max(largest, there);
    total += there;
  }

  std::uint64_t largest = 0;
  std::uint64_t total = 0;

 private:
  std::string beginning_;
  std::uint64_t size_;
};

std::string little_endian(std::uint64_t number) {
  std::string bytes;
  for (int i = 0; i < 8; ++i) {
    bytes += static_cast<char>(number >> (8 * i));
  }
  return bytes;
}

TEST(McapDamage, ADamagedLengthAllocatesNoMemory) {
  const std::uint64_t size = std::uint64_t{400} << 20U;
  Large file(std::string(magic) + static_cast<char>(Opcode::metadata) + little_endian(size - 100),
             size);
  const auto scanned = scan_all(file);
  EXPECT_FALSE(scanned.problems.empty());
  EXPECT_LE(file.largest, 1U << 20U);
}

TEST(McapDamage, AFileFullOfWhatLooksLikeChunksIsNotReadForEver) {
  // Each claims to extend to the end of the file.
  constexpr std::uint64_t size = 4U << 20U;
  constexpr std::uint64_t frame_size = 9 + 40;
  std::string bytes(magic);
  bytes += '\x7f';
  while (bytes.size() + 2 * frame_size < size) {
    const std::uint64_t content = size - bytes.size() - 9;
    const std::uint64_t records = content - 40;
    bytes += static_cast<char>(Opcode::chunk) + little_endian(content) + little_endian(0) +
             little_endian(0) + little_endian(records) + std::string("\1\0\0\0", 4) +
             std::string(4, '\0') + little_endian(records);
  }
  Large file(bytes, size);
  EXPECT_FALSE(scan_all(file).problems.empty());
  EXPECT_LE(file.total, std::uint64_t{1} << 30U);
}

TEST(McapDamage, ContinuesAfterADamagedLength) {
  const auto sample = sample_file(3, 3);
  std::string bytes = sample.bytes;
  bytes[sample.chunk_ends[0] + 1] = '\x7f';  // length of the first message index
  const auto scanned = scan_all(bytes);
  EXPECT_EQ(scanned.messages, sample.messages_within(bytes.size()));
  ASSERT_EQ(scanned.problems.size(), 1U);
  EXPECT_GE(scanned.problems[0].offset, sample.chunk_ends[0]);
}

TEST(McapDamage, NamesTheChunkWhoseChecksumIsWrong) {
  const auto sample = sample_file(3, 3);
  std::string bytes = sample.bytes;
  bytes[sample.chunk_ends[1] - 1] ^= 1;
  const auto scanned = scan_all(bytes);
  ASSERT_EQ(scanned.problems.size(), 1U);
  EXPECT_EQ(scanned.problems[0].text, "the chunk is damaged: its CRC is wrong");
  Memory file(sample.bytes);
  EXPECT_EQ(scanned.problems[0].offset, read_summary(file)->chunks[1].chunk_offset);
  EXPECT_EQ(scanned.messages.size(), 6U);
}

TEST(McapDamage, ReportsMessagesWhoseChannelIsLost) {
  auto sample = sample_file(2, 3);
  sample.bytes.resize(sample.chunk_ends[1]);    // no summary to help
  sample.bytes[sample.chunk_ends[0] - 1] ^= 1;  // the first chunk has the definitions
  const auto scanned = scan_all(sample.bytes);
  EXPECT_TRUE(scanned.messages.empty());
  ASSERT_EQ(scanned.problems.size(), 4U);
  EXPECT_NE(scanned.problems[1].text.find("1 messages from here on belong to channel 1"),
            std::string::npos)
      << scanned.problems[1].text;
}

TEST(McapDamage, DescribesAnEmptyAndAForeignFile) {
  const auto empty = scan_all(std::string());
  ASSERT_EQ(empty.problems.size(), 1U);
  EXPECT_EQ(empty.problems[0].to_string(), "at byte 0: the file is empty");
  const auto foreign = scan_all(std::string("PK\x03\x04 and so on, a good deal longer than magic"));
  ASSERT_EQ(foreign.problems.size(), 1U);
  EXPECT_EQ(foreign.problems[0].to_string(),
            "at byte 0: the file does not begin like an MCAP file");
  EXPECT_TRUE(foreign.messages.empty());
}

TEST(McapDamage, ReadsMessagesOutsideOfChunks) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  append(bytes, Channel{4, 0, "topic", "json", {}});
  append(bytes, Message{4, 1, 10, 10, "{}"});
  append(bytes, DataEnd{0});
  append_footer(bytes, {}, 0);
  bytes += magic;
  const auto scanned = scan_all(bytes);
  EXPECT_EQ(scanned.messages, (std::vector<Read>{{4, 1, 10, "{}"}}));
  EXPECT_EQ(scanned.problems, Problems{});
}

TEST(McapDamage, NamesACompressionItDoesNotRead) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  append(bytes, Chunk{1, 2, 100, 7, "brotli", "compressed"});
  append(bytes, DataEnd{0});
  const auto scanned = scan_all(bytes);
  ASSERT_EQ(scanned.problems.size(), 1U);
  EXPECT_NE(scanned.problems[0].text.find("compressed with 'brotli'"), std::string::npos);
  EXPECT_TRUE(scanned.closed);
}

TEST(McapDamage, NamesTheChunkThatCannotBeDecompressed) {
  for (const char* compression : {"lz4", "zstd"}) {
    std::string bytes(magic);
    append(bytes, Header{"", "someone"});
    const std::uint64_t place = bytes.size();
    append(bytes, Chunk{1, 2, 100, 7, compression, "garbage"});
    append(bytes, DataEnd{0});
    const auto scanned = scan_all(bytes);
    ASSERT_EQ(scanned.problems.size(), 1U);
    EXPECT_EQ(scanned.problems[0].offset, place);
    EXPECT_NE(scanned.problems[0].text.find(std::string("its ") + compression +
                                            " data cannot be decompressed"),
              std::string::npos);
    EXPECT_TRUE(scanned.closed);
  }
}

TEST(McapDamage, ALargeAnnouncedSizeAllocatesNoMemory) {
  constexpr std::uint64_t promised = std::uint64_t{1} << 62U;
  for (const char* compression : {"lz4", "zstd"}) {
    std::string bytes(magic);
    append(bytes, Header{"", "someone"});
    append(bytes, Chunk{1, 2, promised, 7, compression,
                        compress(*compression_of(compression), std::string(100'000, 'x'))});
    const auto scanned = scan_all(bytes);
    EXPECT_FALSE(scanned.problems.empty());
  }
}

// A small file that holds much.

/// A file with one chunk of `records`, without a summary.
std::string file_of(Compression compression, const std::string& records) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  append(bytes, Chunk{1, 2, records.size(), 0, std::string(name_of(compression)),
                      compress(compression, records)});
  append(bytes, DataEnd{0});
  append_footer(bytes, {}, 0);
  return bytes.append(magic);
}

TEST(McapDamage, AChunkThatHoldsAThousandTimesItsSizeIsNotDecompressed) {
  const std::string bytes = file_of(Compression::zstd, std::string(std::size_t{64} << 20U, '\0'));
  ASSERT_LT(bytes.size(), 10'000U);
  Memory file(bytes);
  const Survey sut = survey(file);
  ASSERT_EQ(sut.problems.size(), 1U);
  EXPECT_NE(sut.problems[0].text.find("the chunk declares 67108864 bytes, and "), std::string::npos)
      << sut.problems[0].text;
}

TEST(McapDamage, ZerosInAChunkAreOneProblem) {
  for (const Compression compression : {Compression::none, Compression::lz4, Compression::zstd}) {
    const auto sut = scan_all(file_of(compression, std::string(1'000'000, '\0')));
    EXPECT_EQ(sut.problems.described().size(), 1U);
    EXPECT_EQ(sut.problems.size(), 1U);
  }
}

TEST(McapDamage, EqualProblemsInARowAreOne) {
  std::string records;
  for (int i = 0; i < 1000; ++i) {
    append(records, DataEnd{0});
  }
  const auto sut = scan_all(file_of(Compression::none, records)).problems;
  ASSERT_EQ(sut.size(), 1U);
  EXPECT_NE(sut.described()[0].text.find("(and 999 more of these, the last at byte "),
            std::string::npos)
      << sut.described()[0].text;
}

TEST(McapDamage, OnlyTheFirstOfManyProblemsAreKept) {
  Problems sut;
  for (std::uint64_t i = 0; i < 1'000'000; ++i) {
    sut.add({i, std::string(i == 0 ? 1'000'000 : 1, i % 2 == 0 ? 'a' : 'b')});
  }
  const auto described = sut.described();
  ASSERT_EQ(described.size(), Problems::most + 1);
  EXPECT_LT(described.front().text.size(), Problems::longest_text + 10);
  EXPECT_EQ(described.back().to_string(),
            "at byte 100: from here on 999900 more problems are not listed, the last at byte "
            "999999");
}

TEST(McapDamage, DefinitionsBeyondTheirLimitAreNotKept) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  for (SchemaId id = 1; id <= 100; ++id) {
    std::string records;
    append(records, Schema{id, "s", "", std::string(std::size_t{1} << 20U, ' ')});
    append(bytes, Chunk{1, 2, records.size(), 0, "zstd", compress(Compression::zstd, records)});
  }
  append(bytes, DataEnd{0});
  append_footer(bytes, {}, 0);
  Memory file(bytes.append(magic));
  ASSERT_LT(file.size(), 100'000U);
  const Survey sut = survey(file);
  EXPECT_EQ(sut.summary.definitions.schemas().size(), 63U);
  EXPECT_NE(sut.problems[0].text.find("size limit of all definitions"), std::string::npos);
}

TEST(McapDamage, AMetadataRecordThatASummaryNamesAThousandTimesIsReadWithinALimit) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  const std::uint64_t place = bytes.size();
  append(bytes, Metadata{"large", {{"", std::string(1'000'000, 'x')}}});
  const std::uint64_t length = bytes.size() - place;
  append(bytes, DataEnd{0});
  const std::uint64_t start = bytes.size();
  append(bytes, Statistics{});
  for (int i = 0; i < 1000; ++i) {
    append(bytes, MetadataIndex{place, length, "large"});
  }
  append_footer(bytes, {start, 0}, crc32(Bytes(bytes).substr(start)));
  Memory file(bytes.append(magic));
  const Survey sut = survey(file);
  EXPECT_TRUE(sut.from_summary);
  EXPECT_EQ(sut.metadata.size(), 4U);
  ASSERT_EQ(sut.problems.size(), 1U);
  EXPECT_NE(sut.problems.described()[0].text.find("(and 995 more of these"), std::string::npos)
      << sut.problems.described()[0].text;
}

// Valid files that our recorder does not write.

TEST(McapSurvey, OfAFileWithoutSummaryOrStatisticsIsCountedAndHasNoProblem) {
  std::string records;
  append(records, Channel{4, 0, "topic", "json", {}});
  append(records, Message{4, 1, 10, 10, "{}"});
  const std::string without_summary = file_of(Compression::lz4, records);
  std::string without_statistics = without_summary;
  without_statistics.resize(without_statistics.size() - magic.size() - 29);
  const std::uint64_t start = without_statistics.size();
  append(without_statistics, Channel{4, 0, "topic", "json", {}});
  append_footer(without_statistics, {start, 0}, crc32(Bytes(without_statistics).substr(start)));
  without_statistics += magic;
  for (const std::string& bytes : {without_summary, without_statistics}) {
    Memory file(bytes);
    const Survey sut = survey(file);
    EXPECT_EQ(sut.problems, Problems{}) << sut.problems[0].text;
    EXPECT_TRUE(sut.closed);
    EXPECT_FALSE(sut.from_summary);
    EXPECT_EQ(sut.summary.statistics.messages, 1U);
    Memory repaired;
    EXPECT_EQ(repair(file, repaired, "test")->problems, Problems{});
  }
}

TEST(McapDamage, ASecondFileBehindTheFirstIsReported) {
  const std::string first = sample_file(2, 3).bytes;
  const std::string second = sample_file(1, 3).bytes;
  Memory file(first + second);
  const Survey sut = survey(file);
  EXPECT_FALSE(sut.closed);
  ASSERT_EQ(sut.problems.size(), 1U);
  EXPECT_EQ(sut.problems[0].to_string(),
            "at byte " + std::to_string(first.size()) +
                ": the recording ends here, but the file continues: the " +
                std::to_string(second.size()) + " bytes from here on are not read; 'tail -c +" +
                std::to_string(first.size() + 1) + "' makes a file of them");
}

TEST(McapDamage, AProblemInsideOfACompressedChunkHasTheChunksPlace) {
  std::string records;
  append(records, Message{9, 1, 10, 10, "{}"});
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  const std::uint64_t place = bytes.size();
  append(bytes, Chunk{10, 10, records.size(), 0, "zstd", compress(Compression::zstd, records)});
  append(bytes, DataEnd{0});
  const auto scanned = scan_all(bytes);
  ASSERT_EQ(scanned.problems.size(), 1U);
  EXPECT_EQ(scanned.problems[0].offset, place);
  EXPECT_NE(scanned.problems[0].text.find("belong to channel 9"), std::string::npos);
}

TEST(McapDamage, SkipsPrivateRecordsSilently) {
  std::string bytes(magic);
  append(bytes, Header{"", "someone"});
  bytes += std::string("\x81\x02\0\0\0\0\0\0\0ab", 11);
  append(bytes, DataEnd{0});
  EXPECT_EQ(scan_all(bytes).problems, Problems{});
}

// The recorder's guarantee: a closed chunk survives any end of the file.

class McapRepairOf : public testing::TestWithParam<Compression> {};

INSTANTIATE_TEST_SUITE_P(Each, McapRepairOf,
                         testing::Values(Compression::none, Compression::lz4, Compression::zstd),
                         [](const auto& of) {
                           return of.param == Compression::none ? "none"
                                                                : std::string(name_of(of.param));
                         });

TEST_P(McapRepairOf, RestoresEveryMessageOfEveryWholeChunkWhereverTheFileIsCut) {
  const auto sample = sample_file(4, 3, GetParam());
  for (std::size_t size = 0; size < sample.bytes.size(); ++size) {
    Memory damaged(sample.bytes.substr(0, size));
    Memory repaired;
    const auto report = repair(damaged, repaired, "test");
    ASSERT_TRUE(report);
    ASSERT_FALSE(report->problems.empty()) << "cut at " << size;

    const auto scanned = scan_all(repaired);
    ASSERT_EQ(scanned.messages, sample.messages_within(size)) << "cut at " << size;
    ASSERT_EQ(scanned.problems, Problems{}) << "cut at " << size;
    ASSERT_TRUE(scanned.closed);
    const auto summary = read_summary(repaired);
    ASSERT_TRUE(summary) << summary.error().to_string();
    ASSERT_EQ(summary->statistics, report->saved);
  }
}

TEST_P(McapRepairOf, LeavesWhatWasCompressedCompressed) {
  Memory whole(sample_file(2, 300, GetParam()).bytes);
  Memory repaired;
  ASSERT_TRUE(repair(whole, repaired, "test"));
  const auto found = survey(repaired);
  EXPECT_EQ(found.summary.statistics.messages, 600U);
  ASSERT_EQ(found.chunk_sizes.size(), 1U);
  EXPECT_EQ(found.chunk_sizes.begin()->first, name_of(GetParam()));
}

TEST(McapRepair, LeavesAWholeFileWhole) {
  const auto sample = sample_file(3, 3);
  Memory whole(sample.bytes);
  Memory repaired;
  const auto report = repair(whole, repaired, "test");
  ASSERT_TRUE(report);
  EXPECT_EQ(report->problems, Problems{});
  EXPECT_EQ(report->saved.attachments, 1U);
  EXPECT_EQ(report->saved.metadata, 1U);
  EXPECT_EQ(scan_all(repaired).messages, sample.messages_within(sample.bytes.size()));
}

TEST(McapRepair, ReportsTheSinksError) {
  class Full : public Sink {
    tl::expected<void, std::string> write(Bytes) override {
      return tl::unexpected<std::string>("the disk is full");
    }
  } full;
  Memory damaged(sample_file(1, 1).bytes);
  EXPECT_EQ(repair(damaged, full, "test").error(), "the disk is full");
}

TEST(McapRepair, RefusesAFileThatIsNoRecording) {
  for (const char* const text : {"no recording", "id,at,machine\r\n1,2,3\r\n"}) {
    Memory foreign{std::string(text)};
    Memory repaired;
    const auto report = repair(foreign, repaired, "test");
    ASSERT_FALSE(report) << text;
    EXPECT_NE(report.error().find("it is not a recording"), std::string::npos);
    EXPECT_EQ(repaired.size(), 0U);
  }
}

// The contents of a recording after a power cut at any point of its work.

TEST(RecordingAfterAPowerCut, HasWhatWasSyncedAndIsWholeOnceItIsFinished) {
  const millrace::tests::TemporaryFolder folder;
  const std::string chunk(1000, 'x');
  constexpr unsigned chunks = 5;
  const std::string all((chunks + 1) * chunk.size(), 'x');
  millrace::tests::PowerCutDisk disk(folder.path());
  {
    auto sut = FileSink::create(folder.path() / "run.mcap");
    ASSERT_TRUE(sut);
    for (unsigned done = 1; done <= chunks; ++done) {
      ASSERT_TRUE(sut->write(chunk));
      ASSERT_TRUE(sut->sync());
      disk.promise(done);
    }
    // What was not forced yet is forced before the file gets its name.
    ASSERT_TRUE(sut->write(chunk));
    ASSERT_TRUE(sut->finish());
    disk.promise(chunks + 1);
  }
  for (const millrace::tests::PowerCut& cut : disk.power_cuts()) {
    const auto part = cut.files.find("run.mcap.part");
    const auto whole = cut.files.find("run.mcap");
    const bool finished = whole != cut.files.end();
    EXPECT_TRUE(finished || cut.promised <= chunks) << cut.where;
    if (finished) {
      EXPECT_TRUE(whole->second == all) << cut.where;
    } else if (cut.promised > 0) {
      ASSERT_NE(part, cut.files.end()) << cut.where;
      EXPECT_GE(part->second.size(), cut.promised * chunk.size()) << cut.where;
    }
  }
}

}  // namespace
}  // namespace millrace::tools::mcap
