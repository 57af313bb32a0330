#include "tools/mcap/records.hpp"

#include <array>
#include <string_view>
#include <utility>

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

void Problems::add(Problem problem) {
  if (problem.text.size() > longest_text) {
    problem.text.resize(longest_text);
    problem.text += " …";
  }
  if (omitted_.more == 0 && !list_.empty() && list_.back().first.text == problem.text) {
    ++list_.back().more;
    list_.back().last_offset = problem.offset;
  } else if (list_.size() < most) {
    list_.push_back({std::move(problem)});
  } else {
    if (omitted_.more++ == 0) {
      omitted_.first.offset = problem.offset;
    }
    omitted_.last_offset = problem.offset;
  }
}

std::vector<Problem> Problems::described() const {
  std::vector<Problem> all;
  for (const Run& run : list_) {
    all.push_back(run.first);
    if (run.more > 0) {
      all.back().text += " (and " + std::to_string(run.more) + " more of these, the last at byte " +
                         std::to_string(run.last_offset) + ")";
    }
  }
  if (omitted_.more > 0) {
    all.push_back({omitted_.first.offset, "from here on " + std::to_string(omitted_.more) +
                                              " more problems are not listed, the last at byte " +
                                              std::to_string(omitted_.last_offset)});
  }
  return all;
}

namespace {

std::uint64_t size_of(const Schema& schema) {
  return sizeof schema + schema.name.size() + schema.encoding.size() + schema.data.size();
}

std::uint64_t size_of(const Channel& channel) {
  std::uint64_t size = sizeof channel + channel.topic.size() + channel.message_encoding.size();
  for (const auto& [key, value] : channel.metadata) {
    size += sizeof(StringMap::value_type) + key.size() + value.size();
  }
  return size;
}

}  // namespace

template <typename Definition>
Expected<bool> Definitions::add_to(std::map<std::uint16_t, Definition>& all,
                                   const Definition& definition, const std::string& name,
                                   std::uint64_t offset) {
  if (const auto known = all.find(definition.id); known != all.end()) {
    return known->second == definition
               ? Expected<bool>(false)
               : problem(offset, name + " is defined a second time, and differently");
  }
  if (size_of(definition) > most_bytes - bytes_) {
    return problem(offset, name + " exceeds the size limit of all definitions, 64 MiB");
  }
  bytes_ += size_of(definition);
  all.emplace(definition.id, definition);
  return true;
}

Expected<bool> Definitions::add(const Schema& schema, std::uint64_t offset) {
  return add_to(schemas_, schema,
                "schema " + std::to_string(schema.id) + " ('" + schema.name + "')", offset);
}

Expected<bool> Definitions::add(const Channel& channel, std::uint64_t offset) {
  const std::string name = "channel " + std::to_string(channel.id) + " ('" + channel.topic + "')";
  if (channel.schema != 0 && !schemas_.contains(channel.schema)) {
    return problem(offset, name + " has the schema " + std::to_string(channel.schema) +
                               ", which is not defined before it");
  }
  return add_to(channels_, channel, name, offset);
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
