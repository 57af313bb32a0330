// Reads a file from front to back: whole, cut, damaged or foreign.
//
// Correct records are passed on; problems are reported with their offset. After a broken record the
// scan continues at the next chunk whose CRC matches, so one damaged place costs one chunk.
#pragma once

#include <optional>
#include <string>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

// A chunk in a file that may be damaged: its frame first, then its records, each checked.

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

/// The results of a scan, in the order of the file. Override the functions of interest.
class Visitor {
 public:
  virtual ~Visitor() = default;
  virtual void on_header(const Header&) {}
  /// Once per schema and channel, before its first message.
  virtual void on_schema(const Schema&) {}
  virtual void on_channel(const Channel&) {}
  /// Whether to read the records of this chunk.
  virtual bool wants(const ChunkFrame&) { return true; }
  /// A correct chunk, before its messages.
  virtual void on_chunk(const ChunkFrame&) {}
  /// `offset` is the place of the message's record in the file. Views are valid during the call.
  virtual void on_message(const Channel& /*channel*/, const Message& /*message*/,
                          std::uint64_t /*offset*/) {}
  virtual void on_attachment(const Attachment&) {}
  virtual void on_metadata(const Metadata&, std::uint64_t /*offset*/) {}
  virtual void on_problem(const Problem&) {}
};

/// Scans the data section. `known` are definitions from elsewhere, normally the summary: they are
/// announced first, and make messages readable whose own definitions are lost. Returns true if the
/// data section has an end, that is if the file was closed, and is the only one of the file.
bool scan(Source& source, Definitions known, Visitor& visitor);

}  // namespace millrace::tools::mcap
