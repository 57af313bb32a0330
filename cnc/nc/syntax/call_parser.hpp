// Parses calls of subprograms and cycles (IB/tf5200_programming_manual/206822155, 206859019).
#pragma once

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

/// True if the cursor is at L or LL.
[[nodiscard]] bool at_call(const Cursor& cursor);
/// `L file.nc`, `LL NAME`, `L CYCLE [NAME=file.cyc @P1=3]`; the name may be a string variable.
[[nodiscard]] Statement parse_call(Cursor& cursor);

}  // namespace millrace::cnc::nc::syntax
