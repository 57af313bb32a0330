// Characters that control who shows a text: a terminal, a browser, a shell.
//
//   control_at("\u202Eabc")->size == 3
//   shell_word("hall 3") == "'hall 3'"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace millrace::base::text {

struct Control {
  /// In bytes.
  std::size_t size = 0;
  std::uint32_t code = 0;
};

/// The first character, if it controls a terminal or the order in which text is shown: ASCII and C1
/// controls, direction marks, embeddings, overrides and isolates, line and paragraph separators.
std::optional<Control> control_at(std::string_view utf8);

/// A word of a POSIX shell's command line, in quotes if necessary.
std::string shell_word(std::string_view word);

}  // namespace millrace::base::text
