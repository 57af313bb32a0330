#include "tools/commands/screen.hpp"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

namespace millrace::tools::commands {

namespace {

// Control sequences of every terminal in use (ECMA-48, and xterm's private modes).
constexpr const char* other_screen = "\x1b[?1049h\x1b[?25l";
constexpr const char* first_screen = "\x1b[?25h\x1b[?1049l";
constexpr const char* home = "\x1b[H";
constexpr const char* clear_rest_of_line = "\x1b[K";
constexpr const char* clear_rest_of_screen = "\x1b[J";

void print_now(const std::string& text) {
  fmt::print("{}", text);
  std::fflush(stdout);
}

}  // namespace

bool output_is_terminal() {
  return ::isatty(STDOUT_FILENO) == 1;
}

Screen::Screen() {
  print_now(other_screen);
}

Screen::~Screen() {
  print_now(first_screen);
}

Screen::Size Screen::size() {
  winsize size{};
  // The size of a terminal that does not report one.
  constexpr Size usual{24, 80};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 && size.ws_col > 0
             ? Size{size.ws_row, size.ws_col}
             : usual;
}

void Screen::draw(const std::string& text) {
  // Line by line over what is there, so that nothing flickers.
  std::string out = home;
  for (const char c : text) {
    if (c == '\n') {
      out += clear_rest_of_line;
      out += "\r\n";
    } else {
      out += c;
    }
  }
  print_now(out + clear_rest_of_screen);
}

std::string first_lines(const std::string& text, std::size_t rows) {
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n'));
  if (lines <= rows || rows == 0) {
    return rows == 0 ? "" : text;
  }
  std::size_t end = 0;
  for (std::size_t shown = 0; shown + 1 < rows; ++shown) {
    end = text.find('\n', end) + 1;
  }
  return text.substr(0, end) + fmt::format("… and {} lines more\n", lines - (rows - 1));
}

}  // namespace millrace::tools::commands
