// A terminal that is redrawn repeatedly.
#pragma once

#include <cstddef>
#include <string>

namespace millrace::tools::commands {

/// True if standard output is a terminal.
bool output_is_terminal();

/// Uses the terminal's alternate screen without a cursor while it lives, and restores the first
/// one.
class Screen {
 public:
  Screen();
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  struct Size {
    std::size_t rows;
    std::size_t columns;
  };
  /// As it is now: the user may change it.
  [[nodiscard]] static Size size();

  static void draw(const std::string& text);
};

/// The text without the lines that do not fit, and their number as its last line. Pure.
std::string first_lines(const std::string& text, std::size_t rows);

}  // namespace millrace::tools::commands
