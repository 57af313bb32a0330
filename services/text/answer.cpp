#include "services/text/answer.hpp"

#include <algorithm>

#include "fabric/messages.hpp"

namespace millrace::services::text {

namespace {

constexpr std::string_view ellipsis = "...";
constexpr std::size_t max_quoted = 32;

std::string shortened(std::string text, std::size_t size) {
  if (text.size() > size) {
    text.replace(size - ellipsis.size(), std::string::npos, ellipsis);
  }
  return text;
}

}  // namespace

sdk::Response error(std::uint32_t state, std::string_view message) {
  return {.text = fitting("ERROR: " + std::string(message)), .state = state};
}

std::string fitting(std::string text) {
  return shortened(std::move(text), fabric::max_text);
}

std::string in_quotes(std::string_view text) {
  std::string out = shortened(std::string(text), max_quoted);
  std::replace_if(
      out.begin(), out.end(), [](char c) { return !prints(c); }, '?');
  return "'" + out + "'";
}

bool prints(char c) {
  const auto byte = static_cast<unsigned char>(c);
  constexpr std::string_view open = "\x81\x8D\x8F\x90\x9D";
  return byte >= 0x20 && byte != 0x7F && open.find(c) == std::string_view::npos;
}

}  // namespace millrace::services::text
