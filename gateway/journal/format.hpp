// The journal's bytes: a magic word, then records of length, CRC-32 and protobuf message.
//
//   std::string file = encode_file({entry, entry}) + encode(entry);
//   Contents contents = decode(file);      // all entries up to the first damage
//
//   offset 0  "MRJRNL01"
//   each record: u32 length of the message, u32 CRC-32 of length and message, the message
//   (little endian; idl/journal.proto)
//
// A crash can tear the newest record. decode() stops there and reports it; the records before it
// are complete.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/journal_entry.hpp"

namespace millrace::gateway::journal {

/// First bytes of the file; the digits are the version of the format.
inline constexpr std::string_view magic = "MRJRNL01";

/// One record. The longest is under 1 KiB.
std::string encode(const JournalEntry& entry);

/// A file of these entries, which others can be appended to.
std::string encode_file(const std::vector<JournalEntry>& entries);

struct Contents {
  std::vector<JournalEntry> entries;
  /// Length of the undamaged part, magic included.
  std::size_t good = 0;
  /// The damage after it; empty if there is none.
  std::string damage;
};

/// Never fails: a file that does not begin with `magic` has no good part.
Contents decode(std::string_view file);

}  // namespace millrace::gateway::journal
