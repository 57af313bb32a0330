// Foreign texts for a terminal, a log, a table or an XML file: nothing that came from elsewhere
// controls what shows or reads it.
//
//   quoted("Ma\xDF\x1B[2J") == "\"Maß\\x1b[2J\""
//   safe("a\nb") == "a\\x0ab",  safe("a\nb", "\n") == "a\nb"
//   csv_cell("a,\"b\"") == "\"a,\"\"b\"\"\"",  xml_text("R&D") == "R&amp;D"
#pragma once

#include <string>
#include <string_view>

namespace millrace::base::text {

/// CP1252 bytes in quotes, as UTF-8; what does not print becomes \xNN.
std::string quoted(std::string_view cp1252);

/// The same without quotes, for what is UTF-8 by convention but may hold anything. The control
/// characters in `kept` stay.
std::string safe(std::string_view utf8, std::string_view kept = "");

/// A cell of comma-separated values (RFC 4180): safe(), in quotes where it must be. A text that a
/// spreadsheet would take for a formula (= + - @ in front, and no number) has a ' before it.
std::string csv_cell(std::string_view utf8);

/// Text of an XML element or attribute.
std::string xml_text(std::string_view utf8);

}  // namespace millrace::base::text
