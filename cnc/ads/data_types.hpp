// Data types as ADS devices with symbols describe them: base types, texts, arrays and structures.
// Pure.
//
//   data_type("UDINT", no_structures)->size                          // 4
//   data_type("ARRAY [0..9] OF STRING(20)", no_structures)->size     // 210
//   encode(*data_type("UDINT", no_structures))                       // an entry of the upload
//
// Names are those of IEC 61131-3, which clients know in advance. Layout of an entry: Beckhoff's
// TcAdsDef.h, AdsDatatypeEntry (documented).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cnc/ads/bytes.hpp"

namespace millrace::cnc::ads {

struct ArrayBounds {
  std::int32_t lower = 0;
  std::uint32_t elements = 0;
  bool operator==(const ArrayBounds&) const = default;
};

/// A member of a structure.
struct DataItem {
  std::string name;
  std::string type;
  std::uint32_t size = 0;
  /// Offset in the structure, in bytes.
  std::uint32_t offset = 0;
};

struct DataType {
  std::string name;
  /// Type of the elements of an array; empty for other types.
  std::string element_type{};
  /// In bytes.
  std::uint32_t size = 0;
  /// ADST_…: 19 UDINT, 30 text, 65 structures …
  std::uint32_t number = 65;
  /// Of an array.
  std::vector<ArrayBounds> bounds{};
  /// Of a structure.
  std::vector<DataItem> items{};
};

/// Finds a structure by its name, case-insensitive.
using Structures = std::function<std::optional<DataType>(std::string_view name)>;

/// Finds a type by its name, case-insensitive; nullopt if it is unknown or has more bytes than an
/// index can count.
[[nodiscard]] std::optional<DataType> data_type(std::string_view name,
                                                const Structures& structures);

/// For example "ARRAY [0..9] OF UDINT", "ARRAY [0..1,0..9] OF UDINT".
[[nodiscard]] std::string array_name(const std::vector<ArrayBounds>& bounds,
                                     std::string_view element_type);

/// The entry of a type in the upload and in the response for one type; it begins with its length.
[[nodiscard]] Bytes encode(const DataType& type, const Structures& structures);

}  // namespace millrace::cnc::ads
