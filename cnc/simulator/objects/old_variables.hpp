// The old functions for the variables of a channel, 0x27 to 0x3F of its decoder, by index and by
// name (ISG/312784267 V.E., IB/hmiviaads/15685580171 V.A., ISG/312783243 V.G., documented). They
// cannot carry the strings of the Service Interface: a value has 24 bytes.
#pragma once

#include <cstdint>

#include "cnc/simulator/objects/object.hpp"

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

}  // namespace millrace::cnc::simulator::objects
