// Converts values of variables between their bytes and text; pure.
//
//   auto elements = decode_elements(description, bytes);       // 3.5, or 1 2 3 of an array
//   auto bytes = encode_elements(element_type(description), {"3.5"});
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/ads/bytes.hpp"
#include "cnc/ads/device.hpp"
#include "cnc/variables/addresses.hpp"
#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

/// A BOOLEAN, an integer, a REAL64, or a STRING as CP1252 bytes without its NUL.
using Element = std::variant<bool, std::int64_t, double, std::string>;

/// The type of one element of a variable.
struct ElementType {
  Type type = Type::real64;
  /// In bytes; for a string the whole buffer with its NUL, otherwise the size of the type
  /// (size_of()).
  std::uint32_t size = 8;
  bool operator==(const ElementType&) const = default;
};

/// The type of a scalar, or of each element of an array. Fails if the controller's description is
/// inconsistent; the error contains the numbers that do not match.
tl::expected<ElementType, std::string> element_type(const Description& description);

/// Decodes all elements of an array, or the one that was read. A single string may be shorter than
/// its buffer. The error describes what does not fit.
tl::expected<std::vector<Element>, std::string> decode_elements(ElementType type, BytesView bytes);

/// Encodes elements from text: TRUE, FALSE, 1 or 0 for a BOOLEAN; a number in its type's range; a
/// text in CP1252 of at most 127 bytes, and not longer than its variable. The error names the
/// element and the expected value; nothing is truncated or rounded.
tl::expected<Bytes, std::string> encode_elements(ElementType type,
                                                 const std::vector<std::string>& texts);

// Strings of the CNC: CP1252 bytes, at most 127 of them, NUL-terminated
// (IB/tf527x_kernelv_api/402403595.html, documented).
//
//   auto bytes = encode_text("hello");      // 6 bytes
//   auto text = decode_text(answer);        // 6 or 128 bytes, both are in use

/// Bytes of a CNC string without and with its NUL.
inline constexpr std::size_t max_text = 127;
inline constexpr std::size_t text_size = max_text + 1;

/// The bytes up to the first NUL or the end. Not documented: whether a controller returns the text
/// with its NUL or the whole padded buffer. Both are accepted.
std::string decode_text(ads::BytesView bytes);

/// The text and its NUL. Fails with the reason if the text does not fit or contains a NUL; the text
/// is never truncated.
tl::expected<ads::Bytes, std::string> encode_text(std::string_view text);

/// A number of 4 bytes; any other size is a protocol_error.
ads::Result<std::uint32_t> decode_number(BytesView bytes);

// How to read a value of a controller whose address and type are known (readings.hpp finds them).
// Pure.

struct Reading {
  std::uint16_t port = sda_port;
  ads::Index index;
  /// The most bytes of the response.
  std::uint32_t length = 0;
  /// The input of a ReadWrite; empty for a plain Read.
  Bytes input;
  ElementType type;
  bool is_array = false;
  Access access = Access::read_only;
  /// Size of the whole variable in bytes, and elements in each dimension; empty = a scalar.
  std::uint32_t size = 0;
  std::vector<std::uint32_t> dimensions;
};

/// Why the address or type of a value could not be found.
struct LookupError {
  ads::ErrorCode code = ads::ErrorCode::none;
  /// For people: the error, or the fault in the response.
  std::string reason;
};

}  // namespace millrace::cnc::variables
