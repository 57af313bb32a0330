// The contents of a file without its messages: from its summary, or, if that is missing or damaged,
// from a scan.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

/// In bytes; the summary is read at once. That of a recording of 100 GB has some 20 MB.
inline constexpr std::uint64_t largest_summary = std::uint64_t{64} << 20U;

/// Every part may be missing from a valid file.
struct Summary {
  Header header;
  Definitions definitions;
  bool has_statistics = false;
  Statistics statistics;
  std::vector<ChunkIndex> chunks;
  std::vector<AttachmentIndex> attachments;
  std::vector<MetadataIndex> metadata;
};

/// The first record of the file.
Expected<Header> read_header(Source& source);

/// From the end of the file; reads nothing but header, summary and footer, and checks the CRC. A
/// closed file without a summary has an empty one.
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
  /// In the order of the file, within the limit of read_metadata().
  std::vector<Metadata> metadata;
  /// By compression, as chunks name it.
  std::map<std::string, ChunkSizes> chunk_sizes;
  /// The summary was there and correct, so the rest of the file was not read.
  bool from_summary = false;
  /// It has its end.
  bool closed = false;
  Problems problems;
};

/// The summary, or else a scan, also if the summary has no statistics.
Survey survey(Source& source);

/// The metadata records of a summary. The sum of their sizes is limited to 4 MiB, since a small
/// file may name one large record a thousand times; what exceeds it is a problem.
std::vector<Metadata> read_metadata(Source& source, const Summary& summary, Problems& problems);

}  // namespace millrace::tools::mcap
