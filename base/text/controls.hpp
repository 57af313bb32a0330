// Characters that control the program that shows a text: a terminal, a browser.
//
//   control_at("\u202Eabc")->size == 3
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
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

}  // namespace millrace::base::text
