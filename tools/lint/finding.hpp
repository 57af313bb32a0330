// The findings of the check of an NC program, and its rules.
//
//   Finding finding{{"a.nc", 12, 1}, Rule::wait_without_flush, "…"};
//   about(finding.rule).name       // "wait-without-flush"
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <boost/json/array.hpp>
#include <boost/json/object.hpp>

namespace millrace::tools::lint {

enum class Severity : std::uint8_t { hint, warning, error };

enum class Rule : std::uint8_t {
  syntax,
  not_understood,
  unknown_member,
  wrong_type,
  state_range,
  no_uuid,
  unknown_uuid,
  malformed_uuid,
  text_too_long,
  text_charset,
  wait_without_timeout,
  wait_without_flush,
  wait_before_request,
  wait_for_nothing,
  answer_before_wait,
  answer_not_checked,
  error_goes_on,
  answer_not_awaited,
  answer_written,
  same_state_in_loop,
  request_after_state,
  timer_missing,
  timer_range,
  time_limit,
  shared_timer,
  missing_subprogram,
  misprinted_end,
  unknown_rule,
};

struct RuleInfo {
  Rule rule{};
  /// As in `[wait-without-flush]`, and in the comments that switch it off.
  std::string_view name;
  Severity severity{};
  /// One line for people; docs/reference/lint-rules.md has more.
  std::string_view summary;
};

/// All of them, in the order of the enumeration.
std::span<const RuleInfo> rules();
const RuleInfo& about(Rule rule);
std::optional<Rule> rule_named(std::string_view name);
/// "hint", "warning", "error"
std::string_view name_of(Severity severity);

struct Place {
  std::string file;
  /// Both count from 1.
  int line = 1;
  int column = 1;
  auto operator<=>(const Place&) const = default;
};

struct Finding {
  Place place;
  Rule rule{};
  std::string text;
  auto operator<=>(const Finding&) const = default;
};

// Comments that switch rules off. Pure.
//
//   #WAIT FOR V.G.SERVICE.RESPONSE_STATE != 0 (millrace-lint: off wait-without-timeout)
//   ; millrace-lint: off wait-without-flush, wait-without-timeout         for the line that follows
//   ; millrace-lint: off-file unknown-uuid                                for the whole file

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

// Findings as text, as JSON, and for editors and CI (SARIF 2.1.0). Pure.

/// "part.nc:12:1: warning: … [wait-without-flush]", as compilers write it, with a line end.
std::string text_of(const Finding& finding);

/// {findings: [{file, line, column, severity, rule, text}], not_understood}, the latter the number
/// of blocks.
boost::json::object json_of(const std::vector<Finding>& findings, std::size_t not_understood);

/// A log of one run, with all rules. `version` is this program's.
boost::json::object sarif_of(const std::vector<Finding>& findings, std::size_t not_understood,
                             std::string_view version);

/// "2 errors, 1 warning"; "nothing found; 1 block was not understood", whatever is switched off.
std::string summary_of(const std::vector<Finding>& findings, std::size_t not_understood = 0);

/// Whether the exit code is 1: an error, or, if `strict`, a warning.
bool fails(const std::vector<Finding>& findings, bool strict);

}  // namespace millrace::tools::lint
