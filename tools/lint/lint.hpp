// Checks NC programs before they run: mistakes that the parser finds, and the rules about service
// calls (finding.hpp, docs/reference/lint-rules.md). Pure.
//
//   const Report report = lint({{"part.nc", text}}, {.uuids = known, .load = from_folder});
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/lint/finding.hpp"

namespace millrace::tools::lint {

struct Source {
  /// Its name in findings.
  std::string name;
  /// In the controller's code page.
  std::string text;
};

struct LintOptions {
  /// The canonical UUIDs that are served; without them no UUID is unknown.
  std::optional<std::vector<std::string>> uuids{};
  /// The subprogram or cycle that a program calls by this name; nullopt if it does not exist. Those
  /// that come with millrace need not.
  std::function<std::optional<Source>(const std::string& name)> load{};
  /// Each program runs in its own channel, at the same time as the others.
  bool channels = false;
  std::set<Rule> off{};
};

struct Report {
  /// By file, in the order of `programs` and of the calls in them, then by line.
  std::vector<Finding> findings;
  /// Blocks of all files that were not understood, whatever is switched off.
  std::size_t not_understood = 0;
};

Report lint(const std::vector<Source>& programs, const LintOptions& options);

}  // namespace millrace::tools::lint
