#include "tools/lint/finding.hpp"

#include <algorithm>
#include <array>

namespace millrace::tools::lint {

namespace {

using enum Severity;

constexpr std::array<RuleInfo, 16> all_rules{{
    {Rule::syntax, "syntax", error, "The program cannot be read"},
    {Rule::unknown_uuid, "unknown-uuid", error, "V.G.SERVICE.UUID is served by nobody"},
    {Rule::malformed_uuid, "malformed-uuid", warning, "V.G.SERVICE.UUID is nearly a UUID"},
    {Rule::text_too_long, "text-too-long", error, "A text has more than 127 bytes"},
    {Rule::text_charset, "text-charset", warning, "A text is not in the controller's code page"},
    {Rule::wait_without_timeout, "wait-without-timeout", hint, "A wait may last for ever"},
    {Rule::wait_without_flush, "wait-without-flush", warning,
     "A wait behind motion without #FLUSH may wait for ever"},
    {Rule::wait_before_request, "wait-before-request", error, "A wait for an answer to nothing"},
    {Rule::answer_not_checked, "answer-not-checked", warning,
     "An answer is used without a look at RESPONSE_STATE"},
    {Rule::same_state_in_loop, "same-state-in-loop", warning,
     "The same request with the same REQUEST_STATE again and again"},
    {Rule::request_after_state, "request-after-state", error,
     "UUID or REQUEST is written while the request is out"},
    {Rule::timer_missing, "timer-missing", error, "SysServiceWait.cyc with @P2 and without @P3"},
    {Rule::shared_timer, "shared-timer", warning,
     "Programs of several channels use the same timer"},
    {Rule::missing_subprogram, "missing-subprogram", hint,
     "A subprogram is not there, so what it does is not known"},
    {Rule::misprinted_end, "misprinted-end", warning, "M30/ stands for M30"},
    {Rule::unknown_rule, "unknown-rule", warning, "A comment switches off a rule that is none"},
}};

}  // namespace

std::span<const RuleInfo> rules() {
  return all_rules;
}

const RuleInfo& about(Rule rule) {
  return all_rules.at(static_cast<std::size_t>(rule));
}

std::optional<Rule> rule_named(std::string_view name) {
  const auto* const found = std::ranges::find(all_rules, name, &RuleInfo::name);
  return found == all_rules.end() ? std::nullopt : std::optional(found->rule);
}

std::string_view name_of(Severity severity) {
  constexpr std::array<std::string_view, 3> names{"hint", "warning", "error"};
  return names.at(static_cast<std::size_t>(severity));
}

}  // namespace millrace::tools::lint
