// The global subprograms and cycles that a running program has called, parsed once each.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "cnc/nc/environment.hpp"
#include "cnc/nc/syntax/program.hpp"
#include "cnc/nc/values/result.hpp"

namespace millrace::cnc::nc::run {

class Library {
 public:
  /// Finds a program by the name in its call: first in the environment, then among the cycles of
  /// this library (cycles.hpp). A fault if it is in neither, has mistakes, or exceeds the number of
  /// programs.
  values::Result<std::shared_ptr<const syntax::Program>> find(const std::string& name,
                                                              Environment& environment);
  /// Forgets all programs, since files may have changed.
  void clear() { programs_.clear(); }

 private:
  std::map<std::string, std::shared_ptr<const syntax::Program>> programs_;
};

}  // namespace millrace::cnc::nc::run
