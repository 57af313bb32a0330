// Parses the words and assignments of a block: G01 X10 F100 P1=3 V.P.A=P1*2 "NAME"="text".
#pragma once

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

/// Up to the end of the block, a `$` or a call.
[[nodiscard]] Words parse_words(Cursor& cursor);

}  // namespace millrace::cnc::nc::syntax
