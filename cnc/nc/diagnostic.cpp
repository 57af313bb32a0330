#include "cnc/nc/diagnostic.hpp"

namespace millrace::cnc::nc {

std::string Diagnostic::to_string(std::string_view severity) const {
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
