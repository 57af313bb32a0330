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
  /// A text that names a macro of the program may mean anything.
  explicit Types(const syntax::Program& program);

  /// Only those about V.G.SERVICE, and only certain ones: the controller would abort the program
  /// there.
  [[nodiscard]] std::vector<std::string> mistakes(const syntax::Statement& statement) const;

 private:
  std::set<std::string> macros_;
};

}  // namespace millrace::tools::lint
