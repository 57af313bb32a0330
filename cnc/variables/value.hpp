// Converts values of variables between their bytes and text; pure.
//
//   auto elements = decode_elements(description, bytes);       // 3.5, or 1 2 3 of an array
//   auto bytes = encode_elements(element_type(description), {"3.5"});
#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <tl/expected.hpp>

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

}  // namespace millrace::cnc::variables
