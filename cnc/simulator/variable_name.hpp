// The name of a variable as a program or an ADS client writes it, taken apart.
//
//   auto name = VariableName::parse("V.E.TABLE[2][7]");   // base "V.E.TABLE", indices {2, 7}
//   name = VariableName::parse("V.G.NP[5].V.X");          // base "V.G.NP.V.X", indices {5}, behind
//   4
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace millrace::cnc::simulator {

struct VariableName {
  /// All but the indices.
  std::string base;
  std::vector<std::uint32_t> indices;
  /// Characters of the base that stand behind the indices, as the member of an array's elements
  /// does.
  std::size_t behind = 0;

  /// Nothing if brackets do not match, an index is no number, indices stand in two places, or what
  /// follows them does not begin with a dot.
  static std::optional<VariableName> parse(std::string_view text);
};

}  // namespace millrace::cnc::simulator
