// The findings of the check of an NC program, and its rules.
//
//   Finding finding{{"a.nc", 12, 1}, Rule::wait_without_flush, "…"};
//   about(finding.rule).name       // "wait-without-flush"
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace millrace::tools::lint {

enum class Severity : std::uint8_t { hint, warning, error };

enum class Rule : std::uint8_t {
  syntax,
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

}  // namespace millrace::tools::lint
