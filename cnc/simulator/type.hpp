// The types of CNC variables and their bytes: how a value of the NC language and the bytes of ADS
// become each other.
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
#include <string_view>

#include <tl/expected.hpp>

#include "cnc/ads/device.hpp"
#include "cnc/nc/environment.hpp"
#include "cnc/nc/variable_directory.hpp"
#include "cnc/variables/layout.hpp"
#include "cnc/variables/type.hpp"

namespace millrace::cnc::simulator {

using variables::Type;

/// What one element of a variable holds.
struct ElementType {
  Type type = Type::real64;
  /// In bytes; for a string the whole buffer with its NUL.
  std::uint32_t size = 8;

  static ElementType number(Type type) { return {type, variables::size_of(type)}; }
  /// `characters` and the NUL.
  static ElementType text(std::uint32_t characters) { return {Type::string, characters + 1}; }
};

/// The value in `bytes`, which are as many as `element` takes.
nc::Value decode(ElementType element, ads::BytesView bytes);

/// 0 or no text.
nc::Value zero_of(ElementType element);
/// What people write in a configuration: a number, TRUE, FALSE, or a text in ASCII. Nothing if it
/// does not fit the type.
std::optional<nc::Value> value_of(ElementType element, const std::string& text);

/// The same type as programs declare it, and back; dimensions are not of an element.
nc::VariableShape shape_of(ElementType element);
ElementType element_of(const nc::VariableShape& shape);

/// The bytes of what a program assigns, or the fault for which it is aborted
/// (nc::values::fit).
tl::expected<ads::Bytes, nc::Fault> encode(ElementType element, const nc::Value& value);

/// The bytes of what an ADS client writes. A number must have exactly its size; a string may come
/// with or without its NUL and is filled up with zeros; anything else is invalid_size (our choice).
ads::Result<ads::Bytes> accept(ElementType element, ads::BytesView written);

}  // namespace millrace::cnc::simulator
