// The G functions and # commands that the manual lists (IB/tf5200_programming_manual/
// 5251491951026763659, 5252011631026770315; IB/tccncprogramming/15557311115), beyond those that the
// virtual CNC executes. The lists were read in part: G functions above 102 and some commands are
// those of single pages and of the vendor's editor (isg-stuttgart/vscode-isg-cnc), and incomplete
// (inferred).
#pragma once

#include <string_view>

namespace millrace::cnc::nc::syntax {

/// A # command without an effect on the virtual CNC.
struct ListedCommand {
  std::string_view first;
  /// Empty: whatever follows.
  std::string_view second;
  /// It empties the channel (IB/tf5200_diagnosis/264720011).
  bool flushes = false;
};

/// By the first two words after the #, in any case; null if the manual does not list it, or if it
/// changes the order of execution.
[[nodiscard]] const ListedCommand* find_listed_command(std::string_view first,
                                                       std::string_view second);

[[nodiscard]] bool is_listed_g(double function);
/// G80 to G89, G800 to G839: a subprogram that the channel's configuration names
/// (IB/tf5200_programming_manual/206278923).
[[nodiscard]] bool calls_subprogram(double function);
/// Numbers and axis words after it are values, not positions: G92 X5, G130 X70, G131 50.
[[nodiscard]] bool takes_values(double function);

}  // namespace millrace::cnc::nc::syntax
