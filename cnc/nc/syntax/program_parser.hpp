// Parses the text of a program into its routines, and collects every mistake.
//
//   auto parsed = parse_program("demo.nc", text);
//   if (!parsed) for (const Diagnostic& mistake : parsed.error()) …
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "cnc/nc/diagnostic.hpp"
#include "cnc/nc/syntax/program.hpp"

namespace millrace::cnc::nc::syntax {

/// The parsed program (which may still have `Program::doubts`), or all of its mistakes (at most
/// 200), in the order of the text.
[[nodiscard]] tl::expected<Program, std::vector<Diagnostic>> parse_program(const std::string& file,
                                                                           std::string_view text);

}  // namespace millrace::cnc::nc::syntax
