// Writes entries into an MCAP file.
//
//   RecordingWriter recording(mcap_writer);
//   recording.write(entry);
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "tools/mcap/writer.hpp"
#include "tools/recording/entry.hpp"

namespace millrace::tools::recording {

class RecordingWriter {
 public:
  /// `file` must outlive this; it is empty, or was written by another RecordingWriter that is not
  /// used any more.
  explicit RecordingWriter(mcap::Writer& file) : file_(file) {}

  /// Defines schema and channel when they are new. Fails as the file does.
  mcap::Writer::Result write(const Entry& entry);

 private:
  struct Stream {
    mcap::ChannelId channel = 0;
    std::uint32_t next_sequence = 1;
  };

  Stream& stream_of(const Entry& entry);
  mcap::SchemaId schema_of(const Entry& entry);

  mcap::Writer& file_;
  std::map<std::string, Stream> streams_;
  std::map<std::string, mcap::SchemaId> schemas_;
};

}  // namespace millrace::tools::recording
