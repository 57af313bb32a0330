// The records that a scan has in memory.
#include "tools/mcap/codec.hpp"
#include "tools/mcap/records.hpp"
#include "tools/mcap/scanner.hpp"

namespace millrace::tools::mcap {

namespace {

/// The place of the record whose content begins with `in`.
std::uint64_t prefix_of(const Cursor& in) {
  return in.offset() - record_prefix_size;
}

void announce(Visitor& visitor, const Schema& schema) {
  visitor.on_schema(schema);
}
void announce(Visitor& visitor, const Channel& channel) {
  visitor.on_channel(channel);
}

}  // namespace

void Scanner::take_chunk_records(const ChunkFrame& frame) {
  // Compressed records have no position of their own in the file: the chunk's is used for all of
  // them.
  const bool here = frame.compression.empty();
  const auto place = [&](std::uint64_t offset) { return here ? offset : frame.offset; };
  Cursor in(records_, frame.records_offset);
  while (!in.empty()) {
    const std::uint64_t begin = place(in.offset());
    const std::uint8_t opcode = in.u8();
    const Bytes content = in.take(in.u64());
    if (!in.ok()) {
      report({begin, "the chunk's records end inside a record"});
      break;
    }
    Cursor fields(content, begin + record_prefix_size);
    take(opcode, fields);
  }
  report_lost_messages();
}

void Scanner::take_top_level(std::uint8_t opcode, Cursor& in) {
  if (static_cast<Opcode>(opcode) == Opcode::message_index) {
    return take_index(in);
  }
  if (static_cast<Opcode>(opcode) == Opcode::message && index_expected_) {
    // Its bytes have no CRC of their own; one flipped bit makes a Message of a MessageIndex.
    return report({prefix_of(in), "a Message record is between a chunk and its indexes; skipped"});
  }
  index_expected_ = false;
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::header:
      return hand_out<Header>(in, &Visitor::on_header);
    case Opcode::attachment:
      return hand_out<Attachment>(in, &Visitor::on_attachment);
    case Opcode::metadata:
      return hand_out<Metadata>(in, &Visitor::on_metadata);
    default:
      return take(opcode, in);
  }
}

void Scanner::take(std::uint8_t opcode, Cursor& in) {
  switch (static_cast<Opcode>(opcode)) {
    case Opcode::schema:
      return define<Schema>(in);
    case Opcode::channel:
      return define<Channel>(in);
    case Opcode::message:
      return take_message(in);
    default:
      break;
  }
  if (opcode < first_private_opcode) {
    report({prefix_of(in),
            "a record of type " + opcode_name(opcode) + " does not belong here; skipped"});
  }
}

void Scanner::take_message(Cursor& in) {
  const std::uint64_t offset = prefix_of(in);
  const auto message = decode<Message>(in);
  if (!message) {
    return report(message.error());
  }
  if (const Channel* channel = definitions_.channel(message->channel)) {
    return visitor_.on_message(*channel, *message, offset);
  }
  Lost& lost = lost_[message->channel];
  if (lost.messages++ == 0) {
    lost.first_offset = offset;
  }
}

void Scanner::take_index(Cursor& in) {
  const std::uint64_t offset = prefix_of(in);
  // Its contents are ignored: a reader from front to back needs no index.
  const auto index = decode<MessageIndex>(in);
  if (!index) {
    report(index.error());
  } else if (!index_expected_) {
    report({offset, "a MessageIndex record follows no chunk: a chunk before it is lost"});
  }
}

template <typename Definition>
void Scanner::define(Cursor& in) {
  const std::uint64_t offset = prefix_of(in);
  const auto definition = decode<Definition>(in);
  if (!definition) {
    return report(definition.error());
  }
  const auto added = definitions_.add(*definition, offset);
  if (!added) {
    report(added.error());
  } else if (*added) {
    announce(visitor_, *definition);
  }
}

template <typename Record>
void Scanner::hand_out(Cursor& in, void (Visitor::*to)(const Record&)) {
  const auto record = decode<Record>(in);
  if (!record) {
    return report(record.error());
  }
  (visitor_.*to)(*record);
}

void Scanner::report_lost_messages() {
  for (const auto& [channel, lost] : lost_) {
    report({lost.first_offset, std::to_string(lost.messages) +
                                   " messages from here on belong to "
                                   "channel " +
                                   std::to_string(channel) +
                                   ", whose definition is missing; they cannot be read"});
  }
  lost_.clear();
}

}  // namespace millrace::tools::mcap
