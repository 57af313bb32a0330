// Parses SSD, SSDE, SSDQ and SSDQInit: writes to system data among the words of a block.
//
//   SSD[SD.COUNT = 5]                       a value or a variable, optionally with a minus
//   SSDE[SD.LIMIT = 2 * SQRT[P1]]           any expression
//   SSDQ[SD.ALARMS, SD.CONTROL, "drill"]    a message for the queue
//   SSDQInit[SD.CONTROL]                    empties the queue
//
// The effect of each is documented (DOK-MTX***-NC*F*EX*V13, p. 655). The syntax is not known: it is
// our choice, as is the prefix SD. of the names.
#pragma once

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

[[nodiscard]] bool at_system_data(const Cursor& cursor);
/// The cursor must be at one of them.
[[nodiscard]] WordsItem parse_system_data(Cursor& cursor);
/// SD.NAME
[[nodiscard]] bool is_system_data(const Reference& reference);

}  // namespace millrace::cnc::nc::syntax
