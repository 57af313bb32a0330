#include "tools/mcap/opcode_name.hpp"

#include <array>
#include <string_view>

namespace millrace::tools::mcap {

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

}  // namespace millrace::tools::mcap
