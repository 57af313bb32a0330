// The parts of a variable's name as an NC program or an ADS client writes it.
//
//   auto name = VariableName::parse("V.E.TABLE[2][7]");   // base "V.E.TABLE", indices {2, 7}
//   name = VariableName::parse("V.G.NP[5].V.X");     // base "V.G.NP.V.X", indices {5}, behind 4
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::cnc::simulator {

struct VariableName {
  /// The name without the indices.
  std::string base;
  std::vector<std::uint32_t> indices;
  /// Characters of the base after the indices, such as the member of an array's elements.
  std::size_t behind = 0;

  /// Nullopt if brackets do not match, an index is not a number, indices are in two places, or the
  /// text after them does not begin with a dot.
  static std::optional<VariableName> parse(std::string_view text);
};

}  // namespace millrace::cnc::simulator
