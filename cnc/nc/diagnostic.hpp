// Places in an NC program, and the mistakes there.
#pragma once

#include <string>
#include <string_view>

namespace millrace::cnc::nc {

/// A place in a program; line and column count from 1 (0 = the whole program).
struct Place {
  std::string file;
  int line = 0;
  int column = 0;
  /// The N number of the block, 0 if it has none.
  long block = 0;
};

/// A mistake in a program, found before or during its run.
struct Diagnostic {
  Place place;
  /// The kernel's error id if the vendor documents one, otherwise 0.
  int id = 0;
  std::string text;
  /// The virtual CNC lacks it; a controller may have it.
  bool unknown = false;

  /// "FILE:LINE:COLUMN: N10: error 21462: string for variable too long"; the severity may be
  /// another word, such as "warning".
  [[nodiscard]] std::string to_string(std::string_view severity = "error") const;
};

inline std::string Diagnostic::to_string(std::string_view severity) const {
  std::string out = place.file;
  if (place.line > 0) {
    out += ':' + std::to_string(place.line) + ':' + std::to_string(place.column);
  }
  out += ": ";
  if (place.block > 0) {
    out += 'N' + std::to_string(place.block) + ": ";
  }
  out += severity;
  if (id > 0) {
    out += ' ' + std::to_string(id);
  }
  return out + ": " + text;
}

}  // namespace millrace::cnc::nc
