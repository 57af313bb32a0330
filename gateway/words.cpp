#include "gateway/words.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace millrace::gateway {

std::string printable(std::string_view text) {
  std::string out(text);
  std::ranges::replace_if(
      out, [](char c) { return c < ' ' || c > '~'; }, '?');
  return out;
}

std::string fit_reason(std::string text) {
  constexpr std::size_t most = 255;
  if (text.size() > most) {
    text.replace(most - 3, text.size(), "...");
  }
  return text;
}

std::string why_over(Standing standing, const Snapshot& snapshot) {
  switch (standing) {
    case Standing::cleared:
      return "the program took the request back";
    case Standing::replaced:
      return "the program put another request in its place";
    case Standing::answered:
      return fmt::format("somebody else answered it with RESPONSE_STATE {}",
                         snapshot.response_state);
    case Standing::pending:
      return "the program asks anew";
  }
  return {};
}

}  // namespace millrace::gateway
