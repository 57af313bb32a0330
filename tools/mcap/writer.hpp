// Writes an MCAP file: chunks with CRC and message indexes, then summary, statistics and footer.
//
//   Writer writer(sink, {.library = "millrace 1.0.0"});
//   writer.define(schema);
//   writer.define(channel);
//   writer.write(message);
//   writer.close_chunk();        // now what came before is safe from a cut
//   writer.close();
//
// Bytes reach the sink chunk by chunk, each with its indexes in one write. A refused write is kept
// and sent first the next time.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/mcap/compression.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/sink.hpp"

namespace millrace::tools::mcap {

// The chunk that is being filled: its records and the index of its messages.

class ChunkBuilder {
 public:
  void add(const Schema& schema);
  void add(const Channel& channel);
  void add(const Message& message);

  [[nodiscard]] bool empty() const { return records_.empty(); }
  /// Bytes of its records.
  [[nodiscard]] std::size_t size() const { return records_.size(); }

  /// Appends the chunk and its message indexes to `out`, whose first byte is at `base` of the file,
  /// and starts an empty one. The result has their positions. A chunk that is too large for readers
  /// to decompress is not compressed.
  ChunkIndex finish(std::string& out, std::uint64_t base, Compression compression);

 private:
  std::string records_;
  std::map<ChannelId, MessageIndex> indexes_;
  Nanoseconds start_ = 0;
  Nanoseconds end_ = 0;
};

struct WriterOptions {
  /// Empty: no convention beyond MCAP itself.
  std::string profile{};
  /// The writing program, with version.
  std::string library{};
  /// A chunk is closed when its records have this many bytes.
  std::size_t chunk_size = std::size_t{256} * 1024;
  Compression compression = Compression::none;
};

class Writer {
 public:
  /// The error of the sink.
  using Result = tl::expected<void, std::string>;

  /// `sink` must outlive the writer.
  Writer(Sink& sink, WriterOptions options);

  /// Each schema before the channels that use it, each channel before its messages; a repetition of
  /// the same definition is ignored. Another one under the same id is a mistake of the caller.
  void define(const Schema& schema);
  void define(const Channel& channel);
  [[nodiscard]] bool knows(ChannelId channel) const { return channels_.contains(channel); }

  Result write(const Message& message);
  /// Outside of chunks, at once.
  Result write(const Attachment& attachment);
  Result write(const Metadata& metadata);

  /// Of the chunk that is open and those after it.
  void compress_with(Compression compression) { options_.compression = compression; }

  /// Ends the chunk if there is one, and writes everything to the sink.
  Result close_chunk();
  /// Writes the rest of the file. Nothing may be written afterwards; a refused write may be tried
  /// again.
  Result close();

  [[nodiscard]] const Statistics& statistics() const { return statistics_; }
  /// The number of messages that the sink has.
  [[nodiscard]] std::uint64_t messages_taken() const { return messages_taken_; }
  /// Bytes of the file so far, those of the open chunk included as they will be without
  /// compression.
  [[nodiscard]] std::uint64_t size() const { return written_ + pending_.size() + chunk_.size(); }

 private:
  void end_chunk();
  Result flush();
  /// Adds the rest of `pending_` to the CRC.
  void count();
  void append_summary();
  template <typename Records>
  void append_group(Opcode opcode, const Records& records);

  Sink& sink_;
  WriterOptions options_;
  ChunkBuilder chunk_;
  /// Encoded, not yet given to the sink; its first byte is at `written_`.
  std::string pending_;
  std::uint64_t written_ = 0;
  std::uint32_t data_crc_ = 0;
  /// The number of bytes of `pending_` in the CRC.
  std::size_t counted_ = 0;
  std::uint64_t messages_taken_ = 0;
  /// Of those in closed chunks.
  std::uint64_t messages_chunked_ = 0;
  bool closed_ = false;

  std::map<SchemaId, Schema> schemas_;
  std::map<ChannelId, Channel> channels_;
  std::vector<ChunkIndex> chunks_;
  std::vector<AttachmentIndex> attachments_;
  std::vector<MetadataIndex> metadata_;
  Statistics statistics_;
  std::vector<SummaryOffset> groups_;
};

}  // namespace millrace::tools::mcap
