// Parses expressions and references to variables at the cursor. On a mistake the cursor has failed
// and the result is a placeholder.
//
// Precedence, lowest first (our reading; the manual only promises the usual rules):
//   || OR   XOR   && AND   |   ^   &   == != < > <= >=   + -   * / MOD   unary - NOT   **
#pragma once

#include <vector>

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/expression.hpp"

namespace millrace::cnc::nc::syntax {

/// A whole expression with operators.
[[nodiscard]] Expression parse_expression(Cursor& cursor);
/// The value of a word, which needs no brackets but takes no operator, XP1, X[P1+2].
[[nodiscard]] Expression parse_word_value(Cursor& cursor);
/// P10, V.P.A[2], @P1: at the left of an assignment or in a query.
[[nodiscard]] Reference parse_reference(Cursor& cursor);
/// True if a reference begins here.
[[nodiscard]] bool at_reference(const Cursor& cursor);

}  // namespace millrace::cnc::nc::syntax
