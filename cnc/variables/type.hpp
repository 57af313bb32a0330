// The types of CNC variables by the vendor's names.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

/// Bytes of a number; 0 for a string, whose size varies, and for an unknown type.
std::uint32_t size_of(Type type);
/// For example "UNS32", as attribute 0x200 and the old functions (with V_ before it) name it;
/// "UNKNOWN" for any other number.
std::string_view name_of(Type type);
/// Finds a type by that name, case-insensitive.
std::optional<Type> parse_type(std::string_view name);

/// "READ_ONLY" or "READ_WRITE"; "UNKNOWN" for any other number.
std::string_view name_of(Access access);

}  // namespace millrace::cnc::variables
