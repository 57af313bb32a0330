// The global subprograms and cycles a running program has called, parsed once each.
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
  /// A program by the name it is called by. Asks the environment, then the cycles that come with
  /// this library (cycles.hpp). A fault if it is nowhere or has mistakes.
  values::Result<std::shared_ptr<const syntax::Program>> find(const std::string& name,
                                                              Environment& environment);
  /// Files may have changed: forget them.
  void clear() { programs_.clear(); }

 private:
  std::map<std::string, std::shared_ptr<const syntax::Program>> programs_;
};

}  // namespace millrace::cnc::nc::run
