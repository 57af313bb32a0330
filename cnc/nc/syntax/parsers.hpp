// The parsers of the parts of a block. Each starts at the cursor and moves it.
#pragma once

#include "cnc/nc/syntax/cursor.hpp"
#include "cnc/nc/syntax/expression.hpp"
#include "cnc/nc/syntax/statement.hpp"

namespace millrace::cnc::nc::syntax {

// Parses calls of subprograms and cycles (IB/tf5200_programming_manual/206822155, 206859019).

/// True if the cursor is at L or LL.
[[nodiscard]] bool at_call(const Cursor& cursor);
/// `L file.nc`, `LL NAME`, `L CYCLE [NAME=file.cyc @P1=3]`; the name may be a string variable.
[[nodiscard]] Statement parse_call(Cursor& cursor);

// Parses # commands. All of them are in one table in command_parser.cpp; the larger ones have their
// own files.

/// A command after its `#`.
[[nodiscard]] Statement parse_command(Cursor& cursor);
/// #COMMENT BEGIN up to #COMMENT END, at the word COMMENT.
void parse_comment(Cursor& cursor);

/// All forms of #MSG, after the name (message_parser.cpp). Errors 20721, 20724 and 20726.
[[nodiscard]] Statement parse_message(Cursor& cursor);
/// #VAR … #ENDVAR, after #VAR (declaration_parser.cpp).
[[nodiscard]] Statement parse_declarations(Cursor& cursor);
/// #DELETE, after its name (declaration_parser.cpp).
[[nodiscard]] Statement parse_deletion(Cursor& cursor);

// Parses the words and assignments of a block: G01 X10 F100 P1=3 V.P.A=P1*2 "NAME"="text".

/// Up to the end of the block, a `$` or a call.
[[nodiscard]] Words parse_words(Cursor& cursor);

// Parses SSD, SSDE, SSDQ and SSDQInit: writes to system data among the words of a block.
//
//   SSD[SD.COUNT = 5]                       a value or a variable, optionally with a minus
//   SSDE[SD.LIMIT = 2 * SQRT[P1]]           any expression
//   SSDQ[SD.ALARMS, SD.CONTROL, "drill"]    a message for the queue
//   SSDQInit[SD.CONTROL]                    empties the queue
//
// The effect of each is documented (DOK-MTX***-NC*F*EX*V13, p. 655). The syntax is not known: it is
// our choice, as is the prefix SD. of the names.

[[nodiscard]] bool at_system_data(const Cursor& cursor);
/// The cursor must be at one of them.
[[nodiscard]] WordsItem parse_system_data(Cursor& cursor);
/// SD.NAME
[[nodiscard]] bool is_system_data(const Reference& reference);

// Parses expressions and references to variables at the cursor. On a mistake the cursor has failed
// and the result is a placeholder.
//
// Precedence, lowest first (our reading; the manual only promises the usual rules):
//   || OR   XOR   && AND   |   ^   &   == != < > <= >=   + -   * / MOD   unary - NOT   **

/// A whole expression with operators.
[[nodiscard]] Expression parse_expression(Cursor& cursor);
/// The value of a word, which needs no brackets but takes no operator, XP1, X[P1+2].
[[nodiscard]] Expression parse_word_value(Cursor& cursor);
/// P10, V.P.A[2], @P1: at the left of an assignment or in a query.
[[nodiscard]] Reference parse_reference(Cursor& cursor);
/// True if a reference begins here.
[[nodiscard]] bool at_reference(const Cursor& cursor);
[[nodiscard]] bool begins_reference(const Token& token);
/// True if an expression may begin with the token: X[SIN[30]] is a position, Z[DIST_CTRL ON] not.
[[nodiscard]] bool begins_value(const Token& token);
/// M80, H[P1], MP1
[[nodiscard]] bool at_machine_function(const Cursor& cursor);

}  // namespace millrace::cnc::nc::syntax
