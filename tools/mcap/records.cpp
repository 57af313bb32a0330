#include "tools/mcap/records.hpp"

#include <array>
#include <string_view>

#include <zlib.h>

namespace millrace::tools::mcap {

std::uint32_t crc32(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string opcode_name(std::uint8_t opcode) {
  constexpr std::array<std::string_view, 15> names{
      "Header",     "Footer",       "Schema",        "Channel",       "Message",
      "Chunk",      "MessageIndex", "ChunkIndex",    "Attachment",    "AttachmentIndex",
      "Statistics", "Metadata",     "MetadataIndex", "SummaryOffset", "DataEnd"};
  if (opcode >= 1 && opcode <= names.size()) {
    return std::string(names[opcode - 1U]);
  }
  constexpr std::string_view digits = "0123456789abcdef";
  return std::string("0x") + digits[opcode >> 4U] + digits[opcode & 0xFU];
}

Expected<bool> Definitions::add(const Schema& schema, std::uint64_t offset) {
  const auto [place, added] = schemas_.emplace(schema.id, schema);
  if (place->second != schema) {
    return problem(offset, "schema " + std::to_string(schema.id) + " ('" + schema.name +
                               "') is defined a second time, and differently");
  }
  return added;
}

Expected<bool> Definitions::add(const Channel& channel, std::uint64_t offset) {
  const std::string name = "channel " + std::to_string(channel.id) + " ('" + channel.topic + "')";
  if (channel.schema != 0 && !schemas_.contains(channel.schema)) {
    return problem(offset, name + " has the schema " + std::to_string(channel.schema) +
                               ", which is not defined before it");
  }
  const auto [place, added] = channels_.emplace(channel.id, channel);
  if (place->second != channel) {
    return problem(offset, name + " is defined a second time, and differently");
  }
  return added;
}

const Schema* Definitions::schema(SchemaId id) const {
  const auto place = schemas_.find(id);
  return place == schemas_.end() ? nullptr : &place->second;
}

const Channel* Definitions::channel(ChannelId id) const {
  const auto place = channels_.find(id);
  return place == channels_.end() ? nullptr : &place->second;
}

}  // namespace millrace::tools::mcap
