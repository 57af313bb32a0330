// Records to bytes: each overload appends one whole record, prefix included.
#pragma once

#include <string>

#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

void append(std::string& out, const Header& header);
/// The footer's CRC is computed from `crc_before`, the checksum of the summary up to here.
void append_footer(std::string& out, const Footer& footer, std::uint32_t crc_before);
void append(std::string& out, const Schema& schema);
void append(std::string& out, const Channel& channel);
void append(std::string& out, const Message& message);
void append(std::string& out, const Chunk& chunk);
void append(std::string& out, const MessageIndex& index);
void append(std::string& out, const ChunkIndex& index);
/// With its CRC.
void append(std::string& out, const Attachment& attachment);
void append(std::string& out, const AttachmentIndex& index);
void append(std::string& out, const Statistics& statistics);
void append(std::string& out, const Metadata& metadata);
void append(std::string& out, const MetadataIndex& index);
void append(std::string& out, const SummaryOffset& offset);
void append(std::string& out, const DataEnd& end);

}  // namespace millrace::tools::mcap
