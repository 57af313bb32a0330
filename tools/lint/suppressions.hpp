// Comments that switch rules off. Pure.
//
//   #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0 (millrace-lint: off wait-without-timeout)
//   ; millrace-lint: off wait-without-flush, wait-without-timeout         for the line that follows
//   ; millrace-lint: off-file unknown-uuid                                for the whole file
#pragma once

#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {

class Suppressions {
 public:
  /// Reads the comments of `text`; an unknown rule becomes a finding.
  Suppressions(const std::string& file, std::string_view text);

  [[nodiscard]] bool has(Rule rule, int line) const;
  [[nodiscard]] const std::vector<Finding>& mistakes() const { return mistakes_; }

 private:
  void read(const std::string& file, std::string_view line, int number);

  std::set<Rule> whole_file_;
  std::map<int, std::set<Rule>> lines_;
  std::vector<Finding> mistakes_;
};

}  // namespace millrace::tools::lint
