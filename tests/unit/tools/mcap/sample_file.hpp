// A small recording for tests, and the messages that a reader gets from a file.
#pragma once

#include <string>
#include <vector>

#include "tools/mcap/compression.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap::tests {

/// A message that owns its data.
struct Read {
  ChannelId channel = 0;
  std::uint32_t sequence = 0;
  Nanoseconds log_time = 0;
  std::string data;
  bool operator==(const Read&) const = default;
};
std::ostream& operator<<(std::ostream& out, const Read& message);

struct SampleFile {
  std::string bytes;
  /// The messages of each chunk.
  std::vector<std::vector<Read>> chunks;
  /// Where each chunk's record ends.
  std::vector<std::uint64_t> chunk_ends;
  /// All messages of the chunks that end at or before `size`.
  [[nodiscard]] std::vector<Read> messages_within(std::uint64_t size) const;
};

/// Two channels, a metadata record, an attachment, and `chunks` chunks of `messages` messages each.
SampleFile sample_file(std::size_t chunks, std::size_t messages,
                       Compression compression = Compression::none);

struct Scanned {
  std::vector<Read> messages;
  Problems problems;
  std::size_t metadata = 0;
  std::size_t attachments = 0;
  bool closed = false;
};

/// Scans with the definitions of the summary, if there is one.
Scanned scan_all(Source& source);
Scanned scan_all(const std::string& bytes);

}  // namespace millrace::tools::mcap::tests
