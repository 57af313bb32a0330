// Parses # commands. All of them are in one table in command_parser.cpp; the larger ones have their
// own files.
#pragma once

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

/// A command after its `#`.
[[nodiscard]] Statement parse_command(Cursor& cursor);

/// All forms of #MSG, after the name (message_parser.cpp). Errors 20721, 20724 and 20726.
[[nodiscard]] Statement parse_message(Cursor& cursor);
/// #VAR … #ENDVAR, after #VAR (declaration_parser.cpp).
[[nodiscard]] Statement parse_declarations(Cursor& cursor);
/// #DELETE, after its name (declaration_parser.cpp).
[[nodiscard]] Statement parse_deletion(Cursor& cursor);

}  // namespace millrace::cnc::nc::syntax
