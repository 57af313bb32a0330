// Strings of the CNC: CP1252 bytes, at most 127 of them, NUL-terminated
// (IB/tf527x_kernelv_api/402403595.html, documented).
//
//   auto bytes = encode_text("hello");      // 6 bytes
//   auto text = decode_text(answer);        // 6 or 128 bytes, both are in use
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "cnc/ads/bytes.hpp"

namespace millrace::cnc::variables {

/// Bytes of a CNC string without and with its NUL.
inline constexpr std::size_t max_text = 127;
inline constexpr std::size_t text_size = max_text + 1;

/// The bytes up to the first NUL or the end. Not documented: whether a controller returns the text
/// with its NUL or the whole padded buffer. Both are accepted.
std::string decode_text(ads::BytesView bytes);

/// The text and its NUL. Fails with the reason if the text does not fit or contains a NUL; the text
/// is never truncated.
tl::expected<ads::Bytes, std::string> encode_text(std::string_view text);

}  // namespace millrace::cnc::variables
