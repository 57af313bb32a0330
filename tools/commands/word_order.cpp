#include "tools/commands/word_order.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace millrace::tools::commands {

namespace {

template <std::size_t count>
bool is_among(const std::array<std::string_view, count>& words, const std::string& word) {
  return std::ranges::find(words, word.substr(0, word.find('='))) != words.end();
}

constexpr std::array<std::string_view, 3> with_value{"--fabric-config", "--domain", "--fabric"};
constexpr std::array<std::string_view, 3> flags{"--json", "--csv", "--wide"};
/// About the program itself.
constexpr std::array<std::string_view, 5> own{"--help", "-h", "--version", "--man-page",
                                              "--completion"};

}  // namespace

std::vector<std::string> word_order(std::vector<std::string> words) {
  auto command = words.begin();
  while (command != words.end() && (is_among(with_value, *command) || is_among(flags, *command))) {
    const bool has_value =
        is_among(with_value, *command) && command->find('=') == std::string::npos;
    command += has_value ? std::min<std::ptrdiff_t>(2, words.end() - command) : 1;
  }
  std::vector<std::string> global(words.begin(), command);
  words.erase(words.begin(), command);
  if (words.empty() || (words.front().starts_with('-') && !is_among(own, words.front()))) {
    words.insert(words.begin(), "status");
  }
  // What follows "--" is no option.
  words.insert(std::ranges::find(words, "--"), global.begin(), global.end());
  return words;
}

}  // namespace millrace::tools::commands
