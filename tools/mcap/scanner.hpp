// The walk behind scan().
#pragma once

#include <map>
#include <optional>
#include <string>

#include "tools/mcap/cursor.hpp"
#include "tools/mcap/scan.hpp"

namespace millrace::tools::mcap {

class Scanner {
 public:
  Scanner(Source& source, Definitions known, Visitor& visitor)
      : source_(source), definitions_(std::move(known)), visitor_(visitor) {}

  /// See scan().
  bool run();

 private:
  /// Opcode and content length.
  struct Prefix {
    std::uint8_t opcode = 0;
    std::uint64_t length = 0;
  };

  void announce_known();
  void read_start();
  std::optional<Prefix> read_prefix();
  // Each reads the record at offset_ and moves on to the next.
  void read_record(const Prefix& prefix);
  void read_chunk();
  void read_data_end(const Prefix& prefix);

  // Each takes the content of a record that is in memory.
  void take_chunk_records(const ChunkFrame& frame);
  void take_top_level(std::uint8_t opcode, Cursor& in);
  void take(std::uint8_t opcode, Cursor& in);
  void take_message(Cursor& in);
  void take_index(Cursor& in);
  template <typename Definition>
  void define(Cursor& in);
  template <typename Record>
  void hand_out(Cursor& in, void (Visitor::*to)(const Record&));
  void report_lost_messages();

  void report(const Problem& problem);
  /// Reports, and continues at the next readable chunk.
  void resynchronise(const Problem& problem);
  /// After a record from `begin` to offset_ whose fields do not fill it exactly: goes back to a
  /// chunk inside of it.
  void look_inside(std::uint64_t begin);
  /// Reads [offset_, offset_ + size) into `out` and counts it for the data section's CRC.
  void read_on(std::uint64_t size, std::string& out);

  Source& source_;
  Definitions definitions_;
  Visitor& visitor_;
  std::uint64_t offset_ = 0;
  /// End of the last chunk. The lengths of later records may be wrong.
  std::uint64_t certain_ = 0;
  bool done_ = false;
  bool closed_ = false;
  /// The last record was a chunk or one of its indexes: indexes belong directly after a chunk.
  bool index_expected_ = false;
  /// Of everything before offset_; none once something was skipped or found damaged.
  std::optional<std::uint32_t> data_crc_ = 0;
  std::string content_;
  std::string records_;

  struct Lost {
    std::uint64_t messages = 0;
    std::uint64_t first_offset = 0;
  };
  /// Messages of channels without a definition, in the chunk that is being read.
  std::map<ChannelId, Lost> lost_;
};

}  // namespace millrace::tools::mcap
