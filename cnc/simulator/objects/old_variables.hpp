// The old functions for the variables of a channel, 0x27 to 0x3F of its decoder, by index and by
// name (ISG/312784267 V.E., IB/hmiviaads/15685580171 V.A., ISG/312783243 V.G., documented). They
// cannot carry the strings of the Service Interface: a value has 24 bytes.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "cnc/simulator/objects/object.hpp"
#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator::objects {

/// V.E., 0x27 to 0x30. A scalar has dimension 0. The memory place is GLOBAL or CHANNEL, the address
/// is the offset of the first byte there (our choice: only the types are documented). 0x2F takes
/// the name with an index.
void add_old_external_variables(ObjectTable& table);

/// V.A., 0x31 to 0x38. Names by index have no axis, names in accesses have one.
void add_old_axis_variables(ObjectTable& table);

/// V.G., 0x39 to 0x3F. The name of an array ends with its largest index.
void add_old_global_variables(ObjectTable& table);

/// The axes of the channel, 0x35 and 0x36.
void add_axis_names(ObjectTable& table);

// Values of the old variable functions: EXT_VAR_WERT, a union of 24 bytes
// (IB/hmiviaads/15685580171, documented).

inline constexpr std::size_t old_value_size = 24;
/// Longest text in the union, without the NUL.
inline constexpr std::size_t old_text_characters = 20;

/// A number is at the front, and so is a string of at most 20 characters with its NUL. A longer
/// string fails with invalid_size (our choice).
ads::Result<ads::Bytes> read_old_value(const Variable& variable, std::uint32_t element);

/// `value` has old_value_size bytes.
ads::Result<void> write_old_value(Variable& variable, std::uint32_t element, ads::BytesView value);

// How the old functions list variables: a count, and attributes by index from 0.
//
//   table.add(0x39, count("V.G-max. number", listing));
//   table.add(0x3B, text_by_index("V.G-type by index", 96, listing, type_text));

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
