#include <algorithm>
#include <utility>

#include "tools/mcap/compression.hpp"
#include "tools/mcap/cursor.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/scan.hpp"

namespace millrace::tools::mcap {

namespace {

/// Chunks are some MB at most; read at once, a larger one would be more than a host has memory.
constexpr std::uint64_t largest_chunk = std::uint64_t{1} << 30U;

/// Times, size, CRC and two lengths; the name of the compression comes on top.
constexpr std::uint64_t fixed_content = 8 + 8 + 8 + 4 + 4 + 8;
/// Longer than any name in MCAP's registry.
constexpr std::uint64_t longest_compression = 64;

/// Reads the frame from `bytes`, which begin at the record's prefix.
Expected<ChunkFrame> parse_frame(Bytes bytes, std::uint64_t offset, std::uint64_t file_size) {
  Cursor in(bytes, offset);
  ChunkFrame frame;
  frame.offset = offset;
  const bool is_chunk = in.u8() == static_cast<std::uint8_t>(Opcode::chunk);
  const std::uint64_t content = in.u64();
  frame.start = in.u64();
  frame.end = in.u64();
  frame.uncompressed_size = in.u64();
  frame.crc = in.u32();
  frame.compression = in.text();
  frame.records_size = in.u64();
  frame.records_offset = in.offset();
  const std::uint64_t available = file_size - offset;
  if (!in.ok() || content > available - record_prefix_size) {
    return problem(offset, "the file ends inside a Chunk record, or its length is damaged");
  }
  frame.length = record_prefix_size + content;
  if (!is_chunk || frame.records_size > content ||
      content != fixed_content + frame.compression.size() + frame.records_size) {
    return problem(offset, "the lengths of the Chunk record contradict each other");
  }
  if (frame.compression.empty() && frame.uncompressed_size != frame.records_size) {
    return problem(offset, "the sizes of the Chunk record contradict each other");
  }
  return frame;
}

}  // namespace

Expected<ChunkFrame> read_chunk_frame(Source& source, std::uint64_t offset) {
  std::string bytes;
  source.read(offset, record_prefix_size + fixed_content + longest_compression, bytes);
  return parse_frame(bytes, offset, source.size());
}

Expected<void> read_chunk_records(Source& source, const ChunkFrame& frame, std::string& records) {
  const auto compression = compression_of(frame.compression);
  if (!compression) {
    return problem(frame.offset, "the chunk is compressed with '" + frame.compression +
                                     "'; millrace reads lz4 and zstd: convert the file with "
                                     "'mcap filter --output-compression zstd'");
  }
  if (frame.records_size > largest_chunk) {
    return problem(frame.offset, "the chunk would exceed the size limit: its length is damaged");
  }
  source.read(frame.records_offset, frame.records_size, records);
  if (records.size() != frame.records_size) {
    return problem(frame.offset, "the chunk cannot be read to its end");
  }
  if (*compression != Compression::none) {
    const std::string packed = std::move(records);
    if (const auto done = decompress(*compression, packed, frame.uncompressed_size, records);
        !done) {
      return problem(frame.offset, "the chunk is damaged: its " + frame.compression +
                                       " data cannot be decompressed: " + done.error());
    }
  }
  if (frame.crc != 0 && frame.crc != crc32(records)) {
    return problem(frame.offset, "the chunk is damaged: its CRC is wrong");
  }
  return {};
}

std::optional<std::uint64_t> find_chunk(Source& source, std::uint64_t from, std::uint64_t to) {
  constexpr std::uint64_t window_size = std::uint64_t{64} * 1024;
  constexpr std::uint64_t frame_size = record_prefix_size + fixed_content;
  // A candidate for a chunk is read to check its CRC. A file can be full of candidates, each as
  // long as the rest; so their sum is limited.
  std::uint64_t patience = (std::uint64_t{64} << 20U) + 8 * (to - from);
  std::string window;
  std::string records;
  for (std::uint64_t start = from; start < to; start += window_size) {
    // Overlaps the next window by a frame, so that none is missed between two.
    source.read(start, window_size + frame_size, window);
    for (std::size_t at = 0; at + frame_size <= window.size() && start + at < to; ++at) {
      if (window[at] != static_cast<char>(Opcode::chunk)) {
        continue;
      }
      const auto frame = parse_frame(Bytes(window).substr(at), start + at, source.size());
      if (!frame || frame->crc == 0) {
        continue;
      }
      if (frame->records_size > patience) {
        return std::nullopt;
      }
      patience -= frame->records_size;
      records.clear();
      if (read_chunk_records(source, *frame, records)) {
        return frame->offset;
      }
      // The bytes that were decompressed in vain.
      patience -= std::min<std::uint64_t>(patience, records.size());
    }
  }
  return std::nullopt;
}

}  // namespace millrace::tools::mcap
