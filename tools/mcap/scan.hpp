// Reads a file from front to back: whole, cut, damaged or foreign.
//
// Correct records are passed on; problems are reported with their offset. After a broken record the
// scan continues at the next chunk whose CRC matches, so one damaged place costs one chunk.
#pragma once

#include "tools/mcap/chunk_frame.hpp"
#include "tools/mcap/definitions.hpp"
#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

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
  virtual void on_metadata(const Metadata&) {}
  virtual void on_problem(const Problem&) {}
};

/// Scans the data section. `known` are definitions from elsewhere, normally the summary: they are
/// announced first, and make messages readable whose own definitions are lost. Returns true if the
/// data section has an end, that is if the file was closed.
bool scan(Source& source, Definitions known, Visitor& visitor);

}  // namespace millrace::tools::mcap
