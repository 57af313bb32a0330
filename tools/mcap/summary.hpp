// The contents of a file without its messages: from its summary, or, if that is missing or damaged,
// from a scan.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

struct Summary {
  Header header;
  Definitions definitions;
  Statistics statistics;
  std::vector<ChunkIndex> chunks;
  std::vector<AttachmentIndex> attachments;
  std::vector<MetadataIndex> metadata;
};

/// The first record of the file.
Expected<Header> read_header(Source& source);

/// From the end of the file; reads nothing but header, summary and footer, and checks the CRC.
Expected<Summary> read_summary(Source& source);

/// Of all chunks with the same compression.
struct ChunkSizes {
  std::uint64_t chunks = 0;
  /// Bytes of their records, in the file and as they are read.
  std::uint64_t stored = 0;
  std::uint64_t uncompressed = 0;
  bool operator==(const ChunkSizes&) const = default;
};

struct Survey {
  /// After a scan: statistics and definitions of what can be read; the vectors are empty.
  Summary summary;
  /// Each metadata record, by name.
  std::vector<Metadata> metadata;
  /// By compression, as chunks name it.
  std::map<std::string, ChunkSizes> chunk_sizes;
  /// The summary was there and correct, so the rest of the file was not read.
  bool from_summary = false;
  Problems problems;
};

/// The summary, or else a scan.
Survey survey(Source& source);

/// The metadata record an index points to.
Expected<Metadata> read_metadata(Source& source, const MetadataIndex& index);

}  // namespace millrace::tools::mcap
