// Finds a number where the Service Interface holds a text, and a text where it holds a number.
// Pure.
//
//   const Types types(program);
//   types.mistakes(operation.statement)    // {"REQUEST is a text, and a number is assigned to it …"}
#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "cnc/nc/syntax/program.hpp"

namespace millrace::tools::lint {

namespace syntax = cnc::nc::syntax;

class Types {
 public:
  /// A text that is the name of a macro of the program may stand for anything.
  explicit Types(const syntax::Program& program);

  /// Only those that have to do with V.G.SERVICE, and only what is certain: the program is aborted
  /// there.
  [[nodiscard]] std::vector<std::string> mistakes(const syntax::Statement& statement) const;

 private:
  std::set<std::string> macros_;
};

}  // namespace millrace::tools::lint
