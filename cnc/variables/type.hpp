// The types of CNC variables by the vendor's names.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

/// Bytes of a number; 0 for a string, whose size is its own, and for a type nobody knows.
std::uint32_t size_of(Type type);
/// "UNS32", as attribute 0x200 and the old functions (with V_ before it) name it; "UNKNOWN" for a
/// number that is none of them.
std::string_view name_of(Type type);
/// By that name, in any case.
std::optional<Type> parse_type(std::string_view name);

/// "READ_ONLY" or "READ_WRITE"; "UNKNOWN" for a number that is neither.
std::string_view name_of(Access access);

}  // namespace millrace::cnc::variables
