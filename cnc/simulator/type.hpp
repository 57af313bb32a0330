// The types of CNC variables: converts between values of the NC language and bytes of ADS.
//
//   auto bytes = encode({Type::uns32, 4}, nc::Value{7.0});      // 07 00 00 00
//   nc::Value value = decode({Type::uns32, 4}, *bytes);         // 7.0
//
// Numbers are binary and little endian, strings NUL-terminated CP1252 in a buffer of fixed size
// (IB/tf5200_ads_access_to_cnc/312759947, documented).
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <tl/expected.hpp>

#include "cnc/ads/device.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/variable_info.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/names.hpp"

namespace millrace::cnc::simulator {

using variables::Type;

/// The type of one element of a variable.
struct ElementType {
  Type type = Type::real64;
  /// In bytes; for a string the whole buffer with its NUL.
  std::uint32_t size = 8;

  static ElementType number(Type type) { return {type, variables::size_of(type)}; }
  /// A string of `characters` and the NUL.
  static ElementType text(std::uint32_t characters) { return {Type::string, characters + 1}; }
};

/// The value in `bytes`, whose size must be that of `element`.
nc::Value decode(ElementType element, ads::BytesView bytes);

/// 0, or an empty text.
nc::Value zero_of(ElementType element);
/// Parses a value of a configuration: a number, TRUE, FALSE, or a text in ASCII. Nullopt if it does
/// not fit the type.
std::optional<nc::Value> value_of(ElementType element, const std::string& text);

/// Converts to the type as NC programs declare it, and back; an element has no dimensions.
nc::VariableShape shape_of(ElementType element);
ElementType element_of(const nc::VariableShape& shape);

/// The bytes of an NC program's assignment, or the fault that aborts the program (nc::values::fit).
tl::expected<ads::Bytes, nc::Fault> encode(ElementType element, const nc::Value& value);

/// The bytes of an ADS client's write. A number must have exactly its size; a string may have its
/// NUL or not, and is padded with zeros. Anything else fails with invalid_size (our choice).
ads::Result<ads::Bytes> accept(ElementType element, ads::BytesView written);

}  // namespace millrace::cnc::simulator
