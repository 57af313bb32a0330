// The checksum of MCAP: CRC-32 with zlib's polynomial.
#pragma once

#include <cstdint>
#include <string_view>

namespace millrace::tools::mcap {

/// The checksum of what `before` is the checksum of, followed by `bytes`.
std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0);

}  // namespace millrace::tools::mcap
