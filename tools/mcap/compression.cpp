#include "tools/mcap/compression.hpp"

#include <algorithm>
#include <bit>
#include <memory>
#include <new>
#include <stdexcept>

#include <lz4frame.h>
#include <zstd.h>

namespace millrace::tools::mcap {

namespace {

using Done = tl::expected<void, std::string>;

/// Of the recorder: it shares its processor with services. Higher levels save little of records
/// that are mostly numbers.
constexpr int zstd_level = 1;
/// Readers of zstd keep a window of decompressed data; this is the window of its highest ordinary
/// level.
constexpr std::uint64_t ordinary_window = std::uint64_t{8} << 20U;
/// Grown by at least this.
constexpr std::size_t step = std::size_t{64} * 1024;

Done wrong(std::string why) {
  return tl::unexpected(std::move(why));
}

/// One more piece of a compressed frame.
struct Piece {
  /// Bytes taken from the input and written to the output.
  std::size_t read = 0;
  std::size_t written = 0;
  bool ended = false;
  const char* error = nullptr;
};

/// Feeds `packed` to `take(input, output, room)` until its frame ends, and grows `records` as the
/// bytes come, one byte beyond `size` at most.
template <typename Take>
Done unpack(Bytes packed, std::uint64_t size, std::string& records, Take take) {
  records.clear();
  std::size_t filled = 0;
  bool ended = false;
  while (!ended) {
    const auto most = static_cast<std::size_t>(size) + 1;
    records.resize(std::min(most, std::max(filled + step, 2 * filled)));
    const Piece piece = take(packed, records.data() + filled, records.size() - filled);
    if (piece.error != nullptr) {
      return wrong(piece.error);
    }
    filled += piece.written;
    packed.remove_prefix(piece.read);
    ended = piece.ended;
    if (filled > size) {
      return wrong("it has more bytes than the chunk declares");
    }
    if (!ended && piece.read == 0 && piece.written == 0) {
      return wrong("it ends too early");
    }
  }
  records.resize(filled);
  if (filled != size) {
    return wrong("it has fewer bytes than the chunk declares");
  }
  return packed.empty() ? Done{} : wrong("there are bytes after its end");
}

Done unpack_lz4(Bytes packed, std::uint64_t size, std::string& records) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0U) {
    throw std::bad_alloc();
  }
  const std::unique_ptr<LZ4F_dctx, decltype(&LZ4F_freeDecompressionContext)> context(
      made, LZ4F_freeDecompressionContext);
  return unpack(packed, size, records, [&](Bytes input, char* output, std::size_t room) {
    std::size_t read = input.size();
    std::size_t written = room;
    const std::size_t hint =
        LZ4F_decompress(context.get(), output, &written, input.data(), &read, nullptr);
    return LZ4F_isError(hint) != 0U ? Piece{.error = LZ4F_getErrorName(hint)}
                                    : Piece{read, written, hint == 0};
  });
}

Done unpack_zstd(Bytes packed, std::uint64_t size, std::string& records) {
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                     ZSTD_freeDCtx);
  if (!context) {
    throw std::bad_alloc();
  }
  // A frame may request any amount of memory; more than its content is of no use.
  const auto window = static_cast<int>(std::bit_width(std::max(size, ordinary_window) - 1));
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, window);
  return unpack(packed, size, records, [&](Bytes input, char* output, std::size_t room) {
    ZSTD_inBuffer in{input.data(), input.size(), 0};
    ZSTD_outBuffer out{output, room, 0};
    const std::size_t hint = ZSTD_decompressStream(context.get(), &out, &in);
    return ZSTD_isError(hint) != 0U ? Piece{.error = ZSTD_getErrorName(hint)}
                                    : Piece{in.pos, out.pos, hint == 0};
  });
}

std::string pack_lz4(Bytes records) {
  LZ4F_preferences_t preferences{};
  preferences.frameInfo.contentSize = records.size();
  std::string packed(LZ4F_compressFrameBound(records.size(), &preferences), '\0');
  const std::size_t size = LZ4F_compressFrame(packed.data(), packed.size(), records.data(),
                                              records.size(), &preferences);
  if (LZ4F_isError(size) != 0U) {
    throw std::runtime_error(std::string("lz4: ") + LZ4F_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}

std::string pack_zstd(Bytes records) {
  std::string packed(ZSTD_compressBound(records.size()), '\0');
  const std::size_t size =
      ZSTD_compress(packed.data(), packed.size(), records.data(), records.size(), zstd_level);
  if (ZSTD_isError(size) != 0U) {
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  }
  packed.resize(size);
  return packed;
}

}  // namespace

std::string_view name_of(Compression compression) {
  switch (compression) {
    case Compression::lz4:
      return "lz4";
    case Compression::zstd:
      return "zstd";
    case Compression::none:
      break;
  }
  return "";
}

std::optional<Compression> compression_of(std::string_view name) {
  for (const Compression each : {Compression::none, Compression::lz4, Compression::zstd}) {
    if (name == name_of(each)) {
      return each;
    }
  }
  return std::nullopt;
}

std::uint64_t largest_content(std::uint64_t packed) {
  constexpr std::uint64_t highest_ratio = 1000;
  constexpr std::uint64_t always = std::uint64_t{8} << 20U;
  return std::min(largest_uncompressed, std::max(always, highest_ratio * packed));
}

std::string compress(Compression compression, Bytes records) {
  switch (compression) {
    case Compression::lz4:
      return pack_lz4(records);
    case Compression::zstd:
      return pack_zstd(records);
    case Compression::none:
      break;
  }
  return std::string(records);
}

Done decompress(Compression compression, Bytes packed, std::uint64_t size, std::string& records) {
  if (const std::uint64_t most = largest_content(packed.size()); size > most) {
    return wrong("it would exceed the size limit: the chunk declares " + std::to_string(size) +
                 " bytes, and " + std::to_string(packed.size()) + " compressed bytes may hold " +
                 std::to_string(most));
  }
  switch (compression) {
    case Compression::lz4:
      return unpack_lz4(packed, size, records);
    case Compression::zstd:
      return unpack_zstd(packed, size, records);
    case Compression::none:
      break;
  }
  records = packed;
  return records.size() == size ? Done{} : wrong("its size differs");
}

}  // namespace millrace::tools::mcap
