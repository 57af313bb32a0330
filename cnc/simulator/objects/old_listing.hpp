// How the old functions list variables: a count, and attributes by index from 0.
//
//   table.add(0x39, count("V.G-max. number", listing));
//   table.add(0x3B, text_by_index("V.G-type by index", 96, listing, type_text));
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "cnc/simulator/objects/object.hpp"

namespace millrace::cnc::simulator::objects {

/// The variables of one kind in a row.
struct Listing {
  std::size_t (*size)(const VirtualChannel&);
  /// `index` is smaller than size.
  const Variable& (*at)(const VirtualChannel&, std::size_t index);
  std::string (*name)(const VirtualChannel&, std::size_t index);
};

/// All variables of a family.
Listing list_globals();
Listing list_externals();
/// One entry for each quantity of the axes, without the axis.
Listing list_quantities();
/// The axes themselves.
Listing list_axes();

/// The number of variables; a Read without input.
Object count(std::string name, Listing listing);

// ReadWrite with UNS32 index in; invalid_data beyond the last variable. Texts are returned in a
// buffer of `length` bytes.
Object name_by_index(std::string_view name, std::uint32_t length, Listing listing);
Object text_by_index(std::string_view name, std::uint32_t length, Listing listing,
                     std::string (*text)(const Declaration&));
Object number_by_index(std::string_view name, Listing listing,
                       std::uint32_t (*number)(const Declaration&));
/// EXT_VAR_WERT of a scalar or of the first element of an array.
Object value_by_index(std::string_view name, Listing listing);
/// ReadWrite with a name in, EXT_VAR_WERT out.
Object value_by_name(std::string name);

/// For example "V_UNS32".
std::string type_text(const Declaration& declaration);

}  // namespace millrace::cnc::simulator::objects
