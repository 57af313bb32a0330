// The name of a variable as a program or an ADS client writes it, taken apart.
//
//   auto name = VariableName::parse("V.E.TABLE[2][7]");   // base "V.E.TABLE", indices {2, 7}
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace millrace::cnc::simulator {

struct VariableName {
  /// Everything before the indices; a view into the text that was parsed.
  std::string_view base;
  std::vector<std::uint32_t> indices;

  /// Nothing if brackets do not match, an index is no number, or something follows the indices.
  static std::optional<VariableName> parse(std::string_view text);
};

}  // namespace millrace::cnc::simulator
