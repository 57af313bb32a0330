// Values of the old variable functions: EXT_VAR_WERT, a union of 24 bytes
// (IB/hmiviaads/15685580171, documented).
#pragma once

#include "cnc/simulator/variable.hpp"

namespace millrace::cnc::simulator::objects {

inline constexpr std::size_t old_value_size = 24;
/// Longest text in the union, without the NUL.
inline constexpr std::size_t old_text_characters = 20;

/// A number is at the front, and so is a string of at most 20 characters with its NUL. A longer
/// string fails with invalid_size (our choice).
ads::Result<ads::Bytes> read_old_value(const Variable& variable, std::uint32_t element);

/// `value` has old_value_size bytes.
ads::Result<void> write_old_value(Variable& variable, std::uint32_t element, ads::BytesView value);

}  // namespace millrace::cnc::simulator::objects
