// Records to bytes: each overload appends one whole record, prefix included.
#pragma once

#include <string>

#include "tools/mcap/cursor.hpp"
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

// Bytes to records: the content of one record, without its prefix.
//
//   Cursor in(content, offset_of_content_in_file);
//   auto schema = decode<Schema>(in);
//
// Fields that a later version of the format may have added at the end are left in the cursor.

/// Takes the fields of a record of type T. Bulk data of the result are views into the cursor's
/// bytes. Specialised for the types below.
template <typename T>
Expected<T> decode(Cursor& in);

template <>
Expected<Header> decode(Cursor& in);
template <>
Expected<Footer> decode(Cursor& in);
/// A schema of id 0 is a problem, too.
template <>
Expected<Schema> decode(Cursor& in);
template <>
Expected<Channel> decode(Cursor& in);
template <>
Expected<Message> decode(Cursor& in);
template <>
Expected<Chunk> decode(Cursor& in);
template <>
Expected<MessageIndex> decode(Cursor& in);
template <>
Expected<ChunkIndex> decode(Cursor& in);
/// Checks its CRC.
template <>
Expected<Attachment> decode(Cursor& in);
template <>
Expected<AttachmentIndex> decode(Cursor& in);
template <>
Expected<Statistics> decode(Cursor& in);
template <>
Expected<Metadata> decode(Cursor& in);
template <>
Expected<MetadataIndex> decode(Cursor& in);
template <>
Expected<DataEnd> decode(Cursor& in);

}  // namespace millrace::tools::mcap
