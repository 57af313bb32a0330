// The compression of a chunk's records: none, an LZ4 frame or a Zstandard frame.
//
//   std::string packed = compress(Compression::zstd, records);
//   auto done = decompress(Compression::zstd, packed, chunk.uncompressed_size, records);
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "tools/mcap/records.hpp"

namespace millrace::tools::mcap {

enum class Compression : std::uint8_t { none, lz4, zstd };

/// As a Chunk record names it: "", "lz4", "zstd".
std::string_view name_of(Compression compression);
/// Nullopt for any other name.
std::optional<Compression> compression_of(std::string_view name);

/// Chunks have some MB at most; a larger decompressed size is damaged, or an attempt to use up a
/// reader's memory.
inline constexpr std::uint64_t largest_uncompressed = std::uint64_t{256} << 20U;

/// The largest accepted content of `packed` bytes: 1000 times as many, since 8 kB of zstd can hold
/// 256 MiB of zeros; but always 8 MiB, 32 times a chunk of our recorder.
std::uint64_t largest_content(std::uint64_t packed);

std::string compress(Compression compression, Bytes records);

/// Decompresses `packed` into `records`. The result must have exactly `size` bytes, and `packed` no
/// bytes after its end; the error names the mismatch. Allocates memory as the bytes come, not in
/// advance.
tl::expected<void, std::string> decompress(Compression compression, Bytes packed,
                                           std::uint64_t size, std::string& records);

}  // namespace millrace::tools::mcap
