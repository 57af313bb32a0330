// The names of CNC variables: types by the vendor's names, families. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "cnc/variables/layout.hpp"

namespace millrace::cnc::variables {

/// Bytes of a number; 0 for a string, whose size varies, and for an unknown type.
std::uint32_t size_of(Type type);
/// For example "UNS32", as attribute 0x200 and the old functions (with V_ before it) name it;
/// "UNKNOWN" for any other number.
std::string_view name_of(Type type);

/// "READ_ONLY" or "READ_WRITE"; "UNKNOWN" for any other number.
std::string_view name_of(Access access);

// The families of a CNC's variables, and the parts of a name. Pure.
//
//   family_of("V.G.SERVICE.UUID") == "V.G",  without_indices("V.E.TABLE[1]") == "V.E.TABLE"

/// The families that can be listed: those of the kernel, its configuration and its axes, then those
/// of NC programs. V.CYC variables are read by name only (ISG/312791435.html, documented).
inline constexpr std::array<std::string_view, 7> families{"V.G", "V.E", "V.A", "P",
                                                          "V.P", "V.L", "V.S"};

/// The family of a variable, "V.G" for "V.G.SERVICE.UUID"; empty for a name without one of these
/// families.
std::string_view family_of(std::string_view name);

/// "V.E.TABLE" for "V.E.TABLE[1]". A member of an array's elements keeps its index, which is in the
/// middle of its name: "V.G.NP[5].V.X".
std::string_view without_indices(std::string_view name);

/// True for "V.G.NP[5].V.X" and "V.G.NP[98].V.X", for "V.E.TABLE" and "V.E.TABLE[1]".
bool same_but_for_indices(std::string_view left, std::string_view right);

}  // namespace millrace::cnc::variables
