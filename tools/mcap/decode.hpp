// Bytes to records: the content of one record, without its prefix.
//
//   Cursor in(content, offset_of_content_in_file);
//   auto schema = decode<Schema>(in);
//
// Fields that a later version of the format may have added at the end are left in the cursor.
#pragma once

#include "tools/mcap/cursor.hpp"
#include "tools/mcap/problem.hpp"
#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

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
