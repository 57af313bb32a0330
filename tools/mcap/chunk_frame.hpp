// A chunk in a file that may be damaged: its frame first, then its records, each checked.
#pragma once

#include <optional>
#include <string>

#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

/// Everything of a chunk except its records.
struct ChunkFrame {
  /// Position of the record's prefix in the file.
  std::uint64_t offset = 0;
  /// Prefix included.
  std::uint64_t length = 0;
  Nanoseconds start = 0;
  Nanoseconds end = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t crc = 0;
  std::string compression;
  std::uint64_t records_offset = 0;
  std::uint64_t records_size = 0;
};

/// The frame of the chunk at `offset`. A chunk whose lengths contradict each other or reach beyond
/// the end of the file is a problem; so is a longer record, although a later version of the format
/// could add fields: no version has, and a flipped length would hide the chunks behind it (our
/// choice).
Expected<ChunkFrame> read_chunk_frame(Source& source, std::uint64_t offset);

/// Decompresses the chunk's records into `records`. An unknown compression, a size that differs
/// from the frame's, and a wrong CRC are problems.
Expected<void> read_chunk_records(Source& source, const ChunkFrame& frame, std::string& records);

/// The first position in [from, to) of a chunk whose contents match its CRC; for files with a
/// broken chain of records.
std::optional<std::uint64_t> find_chunk(Source& source, std::uint64_t from, std::uint64_t to);

}  // namespace millrace::tools::mcap
