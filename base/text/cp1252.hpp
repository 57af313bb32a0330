// Converts between the controller's code page (CP1252, of every CNC string) and UTF-8.
//
//   to_utf8("Ma\xDF 1") == "Maß 1"
//   to_cp1252("Maß 1").value() == "Ma\xDF 1"
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace millrace::base::text {

/// Every byte has a meaning: the five that CP1252 leaves undefined (81, 8D, 8F, 90, 9D) become the
/// C1 control of the same number, as in the WHATWG encoding standard, so that nothing is lost.
std::string to_utf8(std::string_view cp1252);

/// The inverse. The error contains the first character without a CP1252 byte, or the first byte
/// that is not UTF-8, with its place: "U+4E2D at byte 3 is not in CP1252".
tl::expected<std::string, std::string> to_cp1252(std::string_view utf8);

/// True if every byte belongs to a valid UTF-8 character.
bool is_utf8(std::string_view text);

}  // namespace millrace::base::text
