// Names of record types for messages.
#pragma once

#include <cstdint>
#include <string>

namespace millrace::tools::mcap {

/// "Chunk", or "0x42" for an opcode without a name.
std::string opcode_name(std::uint8_t opcode);

}  // namespace millrace::tools::mcap
