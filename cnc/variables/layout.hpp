// The byte streams of the generic variable functions (offsets 0x44 to 0x4C), encoded and decoded:
// the virtual CNC decodes what the client encodes, and the reverse.
//
//   auto in = encode(ElementOf{handle, {}}, value);         // write by handle
//   auto what = decode_name(received);                      // read by name
//
// All integers are UNS32, little endian (IB/tf5200_ads_access_to_cnc/312796555.html,
// 312799627.html, 312804235.html, documented). No decoder trusts a length or count of its peer.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/ads/bytes.hpp"

namespace millrace::cnc::variables {

using ads::Bytes;
using ads::BytesView;

/// Type of a variable, as its description encodes it (IB/tf5200_ads_access_to_cnc/1259032331.html,
/// documented).
enum class Type : std::uint32_t {
  boolean = 1,
  sgn08 = 2,
  uns08 = 3,
  sgn16 = 4,
  uns16 = 5,
  sgn32 = 6,
  uns32 = 7,
  real64 = 8,
  string = 9,
};

enum class Access : std::uint32_t { read_only = 1, read_write = 2 };

/// The description of a variable that 0x45 and 0x4C return.
struct Description {
  std::uint32_t handle = 0;
  Type type = Type::real64;
  Access access = Access::read_only;
  /// Bytes of the value.
  std::uint32_t size = 0;
  /// Elements in each dimension; empty = scalar.
  std::vector<std::uint32_t> dimensions;
  /// Set only by 0x45.
  std::string name;

  bool operator==(const Description&) const = default;
};

/// 0x45 returns the name (NUL-terminated), 0x4C does not.
enum class NameInDescription { yes, no };
Bytes encode(const Description& description, NameInDescription with_name);
/// Reads the name if the stream has one.
std::optional<Description> decode_description(BytesView stream);

/// A variable by its handle, with the array index in each dimension; no index = scalar or whole
/// array.
struct ElementOf {
  std::uint32_t handle = 0;
  std::vector<std::uint32_t> indices;

  bool operator==(const ElementOf&) const = default;
};
/// The input of 0x47; with a value, the input of 0x49.
Bytes encode(const ElementOf& element, BytesView value = {});
struct HandleStream {
  ElementOf element;
  /// View into the decoded stream; empty in a read.
  BytesView value;
};
std::optional<HandleStream> decode_handle_stream(BytesView stream);

/// The input of 0x46, 0x48 and 0x4C; with a value, the input of 0x4A: name, NUL, value.
Bytes encode_name(std::string_view name, BytesView value = {});
struct NameStream {
  std::string_view name;
  /// View into the decoded stream; empty in a read.
  BytesView value;
};
/// A stream without NUL is only a name (some clients send none). Nullopt for a name that is empty
/// or longer than documented.
std::optional<NameStream> decode_name(BytesView stream);

/// The input of 0x45 and 0x4B: an index counted from 0 among the variables of a kind.
struct IndexStream {
  std::uint32_t index = 0;
  std::string_view kind;
};
Bytes encode(const IndexStream& stream);
/// The kind is a view into the decoded stream.
std::optional<IndexStream> decode_index_stream(BytesView stream);

}  // namespace millrace::cnc::variables
