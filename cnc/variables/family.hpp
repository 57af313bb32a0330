// The families of a CNC's variables, and the parts of a name. Pure.
//
//   family_of("V.G.SERVICE.UUID") == "V.G",  without_indices("V.E.TABLE[1]") == "V.E.TABLE"
#pragma once

#include <array>
#include <string_view>

namespace millrace::cnc::variables {

/// The families that can be listed: what the kernel, its configuration and its axes have, then what
/// programs have. V.CYC variables are read by name only (ISG/312791435.html, documented).
inline constexpr std::array<std::string_view, 7> families{"V.G", "V.E", "V.A", "P",
                                                          "V.P", "V.L", "V.S"};

/// The family of a variable, "V.G" of "V.G.SERVICE.UUID"; nothing for a name that begins with none
/// of them.
std::string_view family_of(std::string_view name);

/// "V.E.TABLE" of "V.E.TABLE[1]". A member of an array's elements keeps its index, which stands in
/// the middle of its name: "V.G.NP[5].V.X".
std::string_view without_indices(std::string_view name);

/// True of "V.G.NP[5].V.X" and "V.G.NP[98].V.X", of "V.E.TABLE" and "V.E.TABLE[1]".
bool same_but_for_indices(std::string_view left, std::string_view right);

}  // namespace millrace::cnc::variables
