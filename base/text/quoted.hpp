// Escapes foreign texts for a terminal, a log, a shell, a table or an XML file, so that they cannot
// control the program that shows or reads them.
//
//   quoted("Ma\xDF\x1B[2J") == "\"Maß\\x1b[2J\""
//   safe("a\nb") == "a\\x0ab",  safe("a\nb", "\n") == "a\nb"
//   csv_cell("a,\"b\"") == "\"a,\"\"b\"\"\"",  xml_text("R&D") == "R&amp;D"
//   shell_word("hall 3") == "'hall 3'"
#pragma once

#include <string>
#include <string_view>

namespace millrace::base::text {

/// CP1252 bytes in quotes, as UTF-8; unprintable characters become \xNN.
std::string quoted(std::string_view cp1252);

/// The same without quotes, for text that should be UTF-8 but may contain any bytes. The control
/// characters in `kept` stay.
std::string safe(std::string_view utf8, std::string_view kept = "");

/// A cell of comma-separated values (RFC 4180): safe(), in quotes if necessary. A text that a
/// spreadsheet would take for a formula (begins with = + - @ and is not a number) gets a ' in
/// front; also one behind a semicolon, at which some split cells.
std::string csv_cell(std::string_view utf8);

/// A word of a POSIX shell's command line, in quotes if necessary.
std::string shell_word(std::string_view word);

/// Text of an XML element or attribute.
std::string xml_text(std::string_view utf8);

}  // namespace millrace::base::text
